"""A scene as MuJoCo draws it and casts rays into it: every triangle as it is, each object with its materials."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import mujoco
import numpy as np
import numpy.typing as npt

from benchbot.plugin import Pose
from benchbot.simulation import Camera, Frame
from benchbot_scenes.scene import Material, SceneGeometry
from benchbot_sim_mujoco import opengl

Floats = npt.NDArray[np.float64]
Pixel = TypeVar("Pixel", bound=np.generic)

NEAR_M, FAR_M = 0.01, 200.0
ROBOT_GROUP = 1
NO_ROBOT = np.array([group != ROBOT_GROUP for group in range(6)], np.uint8)
"""The groups of shapes that rays meet: a scanner does not see what carries it."""
MATERIALS = 100_000
STEEPEST = 0.1
"""Of a surface: the share by which inverse depth differs among four neighbouring pixels, more is an edge."""
LIGHTS = (((-0.4, -0.3, -1.0), 0.35), ((0.7, 0.5, -0.5), 0.2), ((-0.2, 0.8, -0.2), 0.15))
"""Directions of light, and how bright; together with the ambient light a white floor is nearly white."""
AMBIENT = 0.45
GLASS_ALPHA = 0.25
SKY, GROUND = (0.75, 0.85, 0.95), (0.45, 0.48, 0.4)


@dataclass(frozen=True)
class Shape:
    """A part of the robot: MuJoCo's type, sizes (3,) and colour (4,), and where it is in the map frame."""

    kind: int
    size_m: Floats
    rgba: npt.NDArray[np.float32]
    position_m: Floats
    rotation: Floats


class Drawing:
    """A model without physics, of which loose objects move, and the robot, which rays do not meet."""

    def __init__(self, geometry: SceneGeometry, loose: Collection[str], robot: Sequence[Shape] = ()) -> None:
        self._geometry = geometry
        self._model = _compiled(geometry, loose, robot)
        self._robot = [self._model.body(_robot_name(number)).mocapid[0] for number in range(len(robot))]
        self._data = mujoco.MjData(self._model)
        names = [self._model.geom(index).name for index in range(self._model.ngeom)]
        self._instances = np.array([int(name.partition(" ")[0]) for name in names], np.int32)
        mujoco.mj_forward(self._model, self._data)

    def move(self, moved: Mapping[str, tuple[Floats, Floats]]) -> None:
        """Put objects where translation (3,) and quaternion (4, w first) take them from where they began."""
        for name, (translation_m, quaternion) in moved.items():
            body = self._model.body(name).mocapid[0]
            self._data.mocap_pos[body], self._data.mocap_quat[body] = translation_m, quaternion
        if moved:
            mujoco.mj_kinematics(self._model, self._data)

    def show_robot(self, robot: Sequence[Shape]) -> None:
        """Put the robot's parts where they are."""
        for body, shape in zip(self._robot, robot, strict=True):
            self._data.mocap_pos[body] = shape.position_m
            mujoco.mju_mat2Quat(self._data.mocap_quat[body], shape.rotation)
        if self._robot:
            mujoco.mj_kinematics(self._model, self._data)

    def cast(self, origins: Floats, directions: Floats, range_max_m: float) -> Floats:
        """Return distances (N,) along unit rays (N, 3) from origins (N, 3), +inf where nothing is within the range."""
        distances_m = np.empty(len(origins))
        ends = [*(np.flatnonzero((np.diff(origins, axis=0) != 0).any(1)) + 1), len(origins)]
        start = 0
        for end in ends:
            count = end - start
            hit, found = np.empty(count, np.int32), np.empty(count)
            rays = np.ascontiguousarray(directions[start:end], np.float64).ravel()
            origin = np.ascontiguousarray(origins[start], np.float64)
            mujoco.mj_multiRay(
                self._model, self._data, origin, rays, NO_ROBOT, True, -1, hit, found, None, count, range_max_m
            )
            distances_m[start:end] = np.where((found < 0) | (found >= range_max_m), np.inf, found)
            start = end
        return distances_m

    def render(self, camera: Camera, poses: Sequence[Pose], *, rgb: bool) -> list[Frame]:
        """Return a picture from each pose of the optical frame."""
        view = _View(camera)
        self._canvas.show(self._data)
        return [self._canvas.draw(view, pose.matrix(), self._instances, rgb=rgb) for pose in poses]

    def close(self) -> None:
        """Let go of what draws; it is made again when it is needed."""
        canvas = self.__dict__.pop("_canvas", None)
        if canvas is not None:
            canvas.close()

    @cached_property
    def _canvas(self) -> "_Canvas":
        return _Canvas(self._model)


class _View:
    """The part of the image plane that a camera needs, in pixels of its size, and where its own pixels are in it."""

    def __init__(self, camera: Camera) -> None:
        self.shape = (camera.height, camera.width)
        left, top, right, bottom = -0.5, -0.5, camera.width - 0.5, camera.height - 0.5
        self._distorted: tuple[Floats, Floats] | None = None
        if camera.distortion:
            u = camera.view.x * camera.fx + camera.cx
            v = camera.view.y * camera.fy + camera.cy
            left, right = np.floor(u.min()) - 0.5, np.ceil(u.max()) + 0.5
            top, bottom = np.floor(v.min()) - 0.5, np.ceil(v.max()) + 0.5
            self._distorted = (v - top - 0.5, u - left - 0.5)
        self.width, self.height = round(right - left), round(bottom - top)
        self.x = ((left - camera.cx) / camera.fx, (right - camera.cx) / camera.fx)
        self.y = ((top - camera.cy) / camera.fy, (bottom - camera.cy) / camera.fy)

    def aim(self, eye: Any, optical: Floats) -> None:
        """Set an OpenGL camera; `optical` is the pose (4, 4) of the optical frame: x right, y down, z forward."""
        eye.pos, eye.forward, eye.up = optical[:3, 3], optical[:3, 2], -optical[:3, 1]
        eye.frustum_near, eye.frustum_far = NEAR_M, FAR_M
        eye.frustum_center = NEAR_M * (self.x[0] + self.x[1]) / 2
        eye.frustum_width = NEAR_M * (self.x[1] - self.x[0]) / 2
        eye.frustum_top, eye.frustum_bottom = -NEAR_M * self.y[0], -NEAR_M * self.y[1]

    def own(self, frame: Frame) -> Frame:
        """Return the camera's pixels of a picture.

        Where a lens distorts they lie between those of the picture. Colour is blended of the four around, and so is
        inverse depth, which is linear on a plane, where all four show one surface; all else is that of the nearest.
        """
        if self._distorted is None:
            return frame
        nearest = tuple(np.rint(place).astype(np.intp) for place in self._distorted)
        last = np.array([[[self.height - 2]], [[self.width - 2]]])
        first = np.clip(np.floor(self._distorted).astype(np.intp), 0, last)
        share = np.stack(self._distorted) - first
        around = [(first[0] + down, first[1] + right) for down in (0, 1) for right in (0, 1)]
        weights = [abs(1 - down - share[0]) * abs(1 - right - share[1]) for down in (0, 1) for right in (0, 1)]
        instances = np.stack([frame.instance[place] for place in around])
        nearness = np.stack([1.0 / frame.depth_m[place].astype(np.float64) for place in around])
        is_smooth = (instances == instances[0]).all(0) & (nearness.min(0) > nearness.max(0) * (1 - STEEPEST))
        blended = np.divide(1.0, (nearness * weights).sum(0), out=np.zeros(self.shape), where=is_smooth)
        rgb = sum(frame.rgb[place] * weight[..., None] for place, weight in zip(around, weights, strict=True))
        return Frame(
            np.rint(rgb).astype(np.uint8),
            np.where(is_smooth, blended, frame.depth_m[nearest]).astype(np.float32),
            frame.instance[nearest],
        )


class _Canvas:
    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._context = opengl.context()
        self._renderer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50.value)
        self._size = (0, 0)
        self._scene = mujoco.MjvScene(model, maxgeom=model.ngeom + 10)
        for flag in ("mjRND_SHADOW", "mjRND_REFLECTION", "mjRND_FOG", "mjRND_HAZE", "mjRND_CULL_FACE"):
            self._scene.flags[getattr(mujoco.mjtRndFlag, flag)] = False

    def close(self) -> None:
        """Free what OpenGL holds."""
        self._context.make_current()
        self._renderer.free()
        self._context.free()

    def show(self, data: mujoco.MjData) -> None:
        """Take over where everything is."""
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        option, camera = mujoco.MjvOption(), mujoco.MjvCamera()
        mujoco.mjv_updateScene(self._model, data, option, None, camera, everything, self._scene)
        drawn = self._scene.geoms[: self._scene.ngeom]
        self._geoms = np.full(self._scene.ngeom + 1, -1, np.int32)
        for geom in drawn:
            self._geoms[geom.segid + 1] = geom.objid

    def draw(self, view: _View, optical: Floats, instances: npt.NDArray[np.int32], *, rgb: bool) -> Frame:
        """Draw all channels of one picture; depth and instances are of the centres of pixels."""
        self._context.make_current()
        if self._size != (view.width, view.height):
            mujoco.mjr_resizeOffscreen(view.width, view.height, self._renderer)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._renderer)
            self._renderer.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
            self._size = (view.width, view.height)
        for eye in self._scene.camera:
            view.aim(eye, optical)
        numbers, nearness = self._take(view, segmented=True)
        geoms = self._geoms[numbers.astype(np.int32) @ (1, 2**8, 2**16)]
        instance = np.where(geoms >= 0, instances[geoms], 0).astype(np.int32)
        # Depth is stored as its inverse between the near plane, at 1, and the far one.
        exact_m = NEAR_M * FAR_M / (NEAR_M + nearness.astype(np.float64) * (FAR_M - NEAR_M))
        depth_m = np.where(geoms >= 0, exact_m, np.inf).astype(np.float32)
        colors = self._take(view, segmented=False)[0] if rgb else np.zeros_like(numbers)
        # OpenGL has the bottom row first.
        return view.own(Frame(_flipped(colors), _flipped(depth_m), _flipped(instance)))

    def _take(self, view: _View, *, segmented: bool) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SEGMENT] = segmented
        self._scene.flags[mujoco.mjtRndFlag.mjRND_IDCOLOR] = segmented
        colors = np.empty((view.height, view.width, 3), np.uint8)
        nearness = np.empty((view.height, view.width), np.float32)
        rectangle = mujoco.MjrRect(0, 0, view.width, view.height)
        mujoco.mjr_render(rectangle, self._scene, self._renderer)
        mujoco.mjr_readPixels(colors, nearness, rectangle, self._renderer)
        return colors, nearness


def _flipped(picture: npt.NDArray[Pixel]) -> npt.NDArray[Pixel]:
    return np.ascontiguousarray(picture[::-1])


def _compiled(geometry: SceneGeometry, loose: Collection[str], robot: Sequence[Shape]) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    # A single sample: what is between two objects belongs to one of them.
    spec.visual.quality.offsamples = 0
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [AMBIENT] * 3, [0.0] * 3
    spec.visual.headlight.specular = [0.0] * 3
    for direction, brightness in LIGHTS:
        spec.worldbody.add_light(
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            dir=direction,
            diffuse=[brightness] * 3,
            specular=[0.0] * 3,
            castshadow=False,
        )
    sky = {"builtin": mujoco.mjtBuiltin.mjBUILTIN_GRADIENT, "rgb1": SKY, "rgb2": GROUND, "width": 64, "height": 384}
    spec.add_texture(name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, **sky)
    _add_materials(spec, geometry)
    names = {instance.index: instance.name for instance in geometry.instances}
    bodies = {name: spec.worldbody.add_body(name=name, mocap=True) for name in loose}
    keys = geometry.triangle_instance.astype(np.int64) * MATERIALS + geometry.triangle_material
    for key in np.unique(keys):
        index, material = divmod(int(key), MATERIALS)
        name = f"{index} {material}"
        _add_mesh(spec, name, geometry, geometry.triangles[keys == key])
        body = bodies.get(names.get(index, ""), spec.worldbody)
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            material=f"{material}",
            contype=0,
            conaffinity=0,
        )
    for number, shape in enumerate(robot):
        body = spec.worldbody.add_body(name=_robot_name(number), mocap=True)
        body.add_geom(
            name=_robot_name(number),
            type=mujoco.mjtGeom(shape.kind),
            size=shape.size_m,
            rgba=shape.rgba,
            group=ROBOT_GROUP,
            contype=0,
            conaffinity=0,
        )
    return spec.compile()


def _robot_name(number: int) -> str:
    """Return the name of a part of the robot: that of a shape begins with its instance, which is none."""
    return f"0 robot {number}"


def _add_mesh(spec: mujoco.MjSpec, name: str, geometry: SceneGeometry, triangles: npt.NDArray[np.int32]) -> None:
    used, corners = np.unique(triangles, return_inverse=True)
    # A mesh has four vertices or more.
    used = np.concatenate([used, np.repeat(used[:1], max(4 - len(used), 0))])
    faces = corners.reshape(-1).tolist()
    uvs = np.array([0.0, 1.0]) + geometry.uvs[used] * np.array([1.0, -1.0])
    mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    mesh.uservert, mesh.userface = geometry.vertices[used].astype(np.float64).ravel().tolist(), faces
    mesh.usernormal, mesh.userfacenormal = geometry.normals[used].astype(np.float64).ravel().tolist(), faces
    mesh.usertexcoord, mesh.userfacetexcoord = uvs.ravel().tolist(), faces


def _add_materials(spec: mujoco.MjSpec, geometry: SceneGeometry) -> None:
    for number in sorted({m.base_color_image for m in geometry.materials if m.base_color_image is not None}):
        image = geometry.images[number]
        texture = spec.add_texture(
            name=f"{number}",
            type=mujoco.mjtTexture.mjTEXTURE_2D,
            width=image.shape[1],
            height=image.shape[0],
            nchannel=3,
        )
        texture.data = np.ascontiguousarray(image[::-1, :, :3]).tobytes()
    for number, material in enumerate(geometry.materials):
        added = spec.add_material(
            name=f"{number}",
            rgba=[*_encoded(material), GLASS_ALPHA if material.is_glass else 1.0],
            specular=0.0,
            emission=1.0 if material.is_emissive else 0.0,
        )
        if material.base_color_image is not None:
            added.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = f"{material.base_color_image}"


def _encoded(material: Material) -> list[float]:
    """Return the sRGB values, 0 … 1, of a material's colour."""
    linear = np.clip(material.emission if material.is_emissive else material.base_color, 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return [float(value) for value in encoded]
