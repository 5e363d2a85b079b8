"""Masks of exported scenes: the object of each pixel, by name, as the programs that the files are for draw them."""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
import trimesh

from benchbot.core.geometry import Pose
from benchbot_scenes.exporting.labels import unique_names
from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_mujoco import opengl

Mask = npt.NDArray[np.str_]
NEAR_M, FAR_M = 0.01, 50.0


@dataclass(frozen=True)
class Eye:
    """A pinhole camera whose axis meets the middle of its picture; `pose` (4, 4) is that of its optical frame."""

    width: int
    height: int
    focal_px: float
    pose: npt.NDArray[np.float64]

    @property
    def rays(self) -> npt.NDArray[np.float64]:
        """The directions (H * W, 3) of the middles of pixels, in the map frame."""
        v, u = np.indices((self.height, self.width))
        x, y = (u - (self.width - 1) / 2) / self.focal_px, (v - (self.height - 1) / 2) / self.focal_px
        return np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3) @ self.pose[:3, :3].T


def looking(at: tuple[float, float, float], yaw_deg: float, down_deg: float) -> npt.NDArray[np.float64]:
    """The pose of an optical frame at a place, that looks along a heading and so many degrees down."""
    optical = Pose.from_xyz_rpy_deg((0, 0, 0), (-90 - down_deg, 0, -90))
    return (Pose.planar(at[0], at[1], np.radians(yaw_deg), at[2]) @ optical).matrix()


def of_geometry(geometry: SceneGeometry, eye: Eye) -> Mask:
    """The mask that Embree's rays see of the scene itself."""
    names = unique_names(geometry)
    owners = [names[index] for index in geometry.triangle_instance.tolist()]
    return _traced(geometry.vertices, geometry.triangles, owners, eye)


def of_usd(path: Path, eye: Eye) -> Mask:
    """The mask that Embree's rays see of the meshes of a USD stage, by the display names of what they are in."""
    from pxr import Usd, UsdGeom

    stage: Any = Usd.Stage.Open(str(path))
    points, triangles, owners, count = [], [], [], 0
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            mesh = UsdGeom.Mesh(prim)
            matrix = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default()))
            own = np.array(mesh.GetPointsAttr().Get(), np.float64)
            corners = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
            points.append(own @ matrix[:3, :3] + matrix[3, :3])
            triangles.append(corners + count)
            owners += [prim.GetParent().GetDisplayName()] * len(corners)
            count += len(own)
    return _traced(np.concatenate(points), np.concatenate(triangles), owners, eye)


def of_mjcf(path: Path, eye: Eye) -> Mask:
    """The mask that MuJoCo draws of what is seen of a model, by the names of bodies."""
    spec = mujoco.MjSpec.from_file(str(path))
    spec.visual.quality.offsamples = 0
    spec.visual.global_.offwidth, spec.visual.global_.offheight = eye.width, eye.height
    spec.visual.map.znear, spec.visual.map.zfar, spec.stat.extent = NEAR_M, FAR_M, 1.0
    # Cameras of MuJoCo look along -z, y up.
    turned = eye.pose[:3, :3] @ np.diag([1.0, -1.0, -1.0])
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, turned.ravel())
    fovy_deg = np.degrees(2 * np.arctan(eye.height / 2 / eye.focal_px))
    spec.worldbody.add_camera(name="eye", pos=eye.pose[:3, 3], quat=quaternion, fovy=fovy_deg)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    context = opengl.context()
    drawer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50.value)
    mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, drawer)
    scene, camera = mujoco.MjvScene(model, maxgeom=model.ngeom + 10), mujoco.MjvCamera()
    camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED.value, model.camera("eye").id
    everything = mujoco.mjtCatBit.mjCAT_ALL.value
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, everything, scene)
    for flag in (mujoco.mjtRndFlag.mjRND_SEGMENT, mujoco.mjtRndFlag.mjRND_IDCOLOR):
        scene.flags[flag] = True
    picture, area = np.empty((eye.height, eye.width, 3), np.uint8), mujoco.MjrRect(0, 0, eye.width, eye.height)
    mujoco.mjr_render(area, scene, drawer)
    mujoco.mjr_readPixels(picture, None, area, drawer)
    drawer.free()
    context.free()
    drawn = np.full(scene.ngeom + 1, -1)
    for geom in scene.geoms[: scene.ngeom]:
        drawn[geom.segid + 1] = geom.objid
    # The bottom row comes first.
    geoms = drawn[picture[::-1].astype(int) @ (1, 2**8, 2**16)]
    names = np.array([model.body(body).name for body in model.geom_bodyid] + [""])
    mask: Mask = names[geoms]
    return mask


def of_sdf(path: Path, eye: Eye) -> Mask:
    """The mask that Drake draws of a world, by the names of models."""
    # In a process of its own: VTK shuts EGL down behind the back of all others.
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        return pool.submit(_drawn_by_drake, path, eye).result()


def _drawn_by_drake(path: Path, eye: Eye) -> Mask:
    from pydrake import all as drake

    builder = drake.DiagramBuilder()
    plant, graph = drake.AddMultibodyPlantSceneGraph(builder, 0.0)
    drake.Parser(plant).AddModels(str(path))
    plant.Finalize()
    graph.AddRenderer("vtk", drake.MakeRenderEngineVtk(drake.RenderEngineVtkParams()))
    # Counted from the corner of the first pixel.
    middle = eye.width / 2, eye.height / 2
    intrinsics = drake.CameraInfo(eye.width, eye.height, eye.focal_px, eye.focal_px, *middle)
    clipping = drake.ClippingRange(NEAR_M, FAR_M)
    core = drake.RenderCameraCore("vtk", intrinsics, clipping, drake.RigidTransform())
    world = plant.GetBodyFrameIdOrThrow(plant.world_body().index())
    depth = drake.DepthRenderCamera(core, drake.DepthRange(2 * NEAR_M, FAR_M / 2))
    pose = drake.RigidTransform(eye.pose)
    camera = builder.AddSystem(drake.RgbdSensor(world, pose, drake.ColorRenderCamera(core), depth))
    builder.Connect(graph.get_query_output_port(), camera.query_object_input_port())
    context = builder.Build().CreateDefaultContext()
    bodies = camera.label_image_output_port().Eval(camera.GetMyContextFromRoot(context)).data[..., 0].astype(int)
    names = {
        number: plant.GetModelInstanceName(plant.get_body(drake.BodyIndex(number)).model_instance())
        for number in np.unique(bodies).tolist()
        if number < plant.num_bodies()
    }
    mask: Mask = np.array([[names.get(number, "") for number in row] for row in bodies.tolist()])
    return mask


def _traced(vertices: Any, triangles: Any, owners: list[str], eye: Eye) -> Mask:
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    found = mesh.ray.intersects_first(np.tile(eye.pose[:3, 3], (eye.width * eye.height, 1)), eye.rays)
    mask: Mask = np.array([*owners, ""])[found].reshape(eye.height, eye.width)
    return mask
