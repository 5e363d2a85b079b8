// The place in three dimensions: the points that were seen so far, boxes, and the robot's way. three.js draws it.
import { root } from "./help.js";

const COLORS = { found: 0x1d5a8f, missed: 0xd0442f, "not there": 0xc98a12, ignored: 0x888888, there: 0x888888, estimate: 0x1d5a8f };
const TURN = 0.07;

function loadLibrary() {
  if (globalThis.THREE) return Promise.resolve(globalThis.THREE);
  return new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = `${root}static/three.js`;
    script.onload = () => resolve(globalThis.THREE);
    script.onerror = () => reject(new Error("three.js"));
    document.head.append(script);
  });
}

function decoded(text, Type) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Type(bytes.buffer);
}

/** Show a scene on a canvas; returns functions to show an observation and to light an object. Rejects without WebGL. */
export async function showSpace(canvas, episode, place, cloud) {
  const three = await loadLibrary();
  const renderer = new three.WebGLRenderer({ canvas, antialias: true, alpha: true });
  const scene = new three.Scene();
  const camera = new three.PerspectiveCamera(45, 1, 0.05, 500);
  camera.up.set(0, 0, 1);
  const map = episode.scenes[place];
  const target = new three.Vector3((map.low[0] + map.high[0]) / 2, (map.low[1] + map.high[1]) / 2, 0.6);
  const reach = Math.max(map.high[0] - map.low[0], map.high[1] - map.low[1]);
  const orbit = { azimuth: -2.2, height: 0.85, distance: 1.45 * reach };
  let [wanted, count, starts] = [0, 0, []];
  let points = null;
  if (cloud) {
    const [raw, colors, frames, scenes] = [decoded(cloud.points, Uint16Array), decoded(cloud.colors, Uint8Array), decoded(cloud.frames, Uint16Array), decoded(cloud.scenes, Uint8Array)];
    const order = [...frames.keys()].filter((i) => scenes[i] === place).sort((i, j) => frames[i] - frames[j]);
    const positions = new Float32Array(3 * order.length);
    const shades = new Float32Array(3 * order.length);
    order.forEach((from, to) => {
      for (let axis = 0; axis < 3; axis += 1) {
        positions[3 * to + axis] = cloud.low[axis] + cloud.scale_m * raw[3 * from + axis];
        shades[3 * to + axis] = colors[3 * from + axis] / 255;
      }
    });
    starts = new Array(episode.frames.length + 1).fill(0);
    for (const from of order) starts[frames[from] + 1] += 1;
    for (let i = 1; i < starts.length; i += 1) starts[i] += starts[i - 1];
    count = order.length;
    const geometry = new three.BufferGeometry();
    geometry.setAttribute("position", new three.BufferAttribute(positions, 3));
    geometry.setAttribute("color", new three.BufferAttribute(shades, 3));
    points = new three.Points(geometry, new three.PointsMaterial({ size: 0.05, vertexColors: true, sizeAttenuation: true }));
    scene.add(points);
  }
  const grid = new three.GridHelper(Math.ceil(reach) + 1, Math.ceil(reach) + 1, 0x999999, 0x999999);
  grid.rotation.x = Math.PI / 2;
  grid.position.set(Math.round(target.x), Math.round(target.y), -0.01);
  grid.material.transparent = true;
  grid.material.opacity = 0.22;
  scene.add(grid);
  const boxes = new Map();
  for (const item of episode.objects) {
    if (item.scene !== place) continue;
    for (const [box, isTrue] of [[item.true, true], [item.estimated, false]]) {
      if (!box) continue;
      const edges = new three.EdgesGeometry(new three.BoxGeometry(...box.slice(3)));
      const color = isTrue && item.outcome !== "missed" ? 0x9a9a90 : COLORS[item.outcome];
      const lines = new three.LineSegments(edges, new three.LineBasicMaterial({ color, transparent: true, opacity: 0.9 }));
      lines.position.set(...box.slice(0, 3));
      const body = new three.Mesh(new three.BoxGeometry(...box.slice(3)), new three.MeshBasicMaterial({ color: COLORS[item.outcome], transparent: true, opacity: 0, depthWrite: false }));
      body.position.copy(lines.position);
      body.userData.object = item.number;
      scene.add(lines, body);
      if (!boxes.has(item.number)) boxes.set(item.number, []);
      boxes.get(item.number).push([lines, body]);
    }
  }
  const way = episode.frames.filter((frame) => frame.scene === place && frame.base).map((frame) => new three.Vector3(frame.base[0], frame.base[1], 0.03));
  if (way.length > 1) scene.add(new three.Line(new three.BufferGeometry().setFromPoints(way), new three.LineBasicMaterial({ color: 0x3a7fc4 })));
  const robot = new three.Mesh(new three.ConeGeometry(0.14, 0.4, 20), new three.MeshBasicMaterial({ color: 0xffc400 }));
  const turned = new three.Group();
  robot.rotation.z = -Math.PI / 2;
  turned.add(robot);
  scene.add(turned);

  function render() {
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width) return;
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    const flat = Math.cos(orbit.height) * orbit.distance;
    camera.position.set(target.x + flat * Math.cos(orbit.azimuth), target.y + flat * Math.sin(orbit.azimuth), target.z + Math.sin(orbit.height) * orbit.distance);
    camera.lookAt(target);
    renderer.render(scene, camera);
  }
  let isAsked = false;
  const soon = () => { if (!isAsked) { isAsked = true; requestAnimationFrame(() => { isAsked = false; render(); }); } };
  const turn = (azimuth, height) => {
    orbit.azimuth += azimuth;
    orbit.height = Math.min(Math.max(orbit.height + height, 0.05), 1.55);
    soon();
  };
  const zoom = (factor) => { orbit.distance = Math.min(Math.max(orbit.distance * factor, 0.5), 6 * reach); soon(); };
  const pan = (x, y) => {
    const size = orbit.distance / canvas.clientHeight;
    target.x += size * (x * Math.sin(orbit.azimuth) + y * -Math.cos(orbit.azimuth));
    target.y += size * (-x * Math.cos(orbit.azimuth) + y * -Math.sin(orbit.azimuth));
    soon();
  };
  const held = new Map();
  let [moved, gap] = [0, 0];
  canvas.addEventListener("pointerdown", (event) => { held.set(event.pointerId, event); moved = 0; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointerup", (event) => { held.delete(event.pointerId); gap = 0; });
  canvas.addEventListener("pointercancel", (event) => { held.delete(event.pointerId); gap = 0; });
  canvas.addEventListener("pointermove", (event) => {
    const before = held.get(event.pointerId);
    if (!before) return;
    const [x, y] = [event.clientX - before.clientX, event.clientY - before.clientY];
    held.set(event.pointerId, event);
    moved += Math.abs(x) + Math.abs(y);
    if (held.size === 2) {
      const [one, other] = [...held.values()];
      const now = Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
      if (gap) zoom(gap / now);
      gap = now;
    } else if (event.buttons === 2 || event.shiftKey) pan(x, y);
    else turn(-0.008 * x, 0.008 * y);
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(0.0012 * event.deltaY)); }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const act = {
      ArrowLeft: () => turn(-TURN, 0), ArrowRight: () => turn(TURN, 0), ArrowUp: () => turn(0, TURN), ArrowDown: () => turn(0, -TURN),
      "+": () => zoom(0.9), "=": () => zoom(0.9), "-": () => zoom(1.1),
    }[event.key];
    if (act) { act(); event.preventDefault(); event.stopPropagation(); }
  });
  new ResizeObserver(soon).observe(canvas);
  return {
    at(number) {
      wanted = number;
      if (points) points.geometry.setDrawRange(0, Math.min(starts[Math.min(wanted + 1, starts.length - 1)], count));
      const frame = episode.frames[number];
      turned.visible = Boolean(frame?.base) && frame.scene === place;
      if (turned.visible) { turned.position.set(frame.base[0], frame.base[1], 0.15); turned.rotation.z = frame.base[2]; }
      soon();
    },
    light(number) {
      for (const [key, pairs] of boxes) for (const [lines, body] of pairs) {
        body.material.opacity = key === number ? 0.35 : 0;
        lines.material.opacity = number === null || key === number ? 0.9 : 0.3;
      }
      soon();
    },
    pick(event) {
      if (moved > 5) return null;
      const bounds = canvas.getBoundingClientRect();
      const pointer = new three.Vector2((2 * (event.clientX - bounds.left)) / bounds.width - 1, 1 - (2 * (event.clientY - bounds.top)) / bounds.height);
      const caster = new three.Raycaster();
      caster.setFromCamera(pointer, camera);
      const bodies = [...boxes.values()].flat().map(([, body]) => body);
      const found = caster.intersectObjects(bodies).sort((x, y) => volume(x.object) - volume(y.object));
      return found.length ? found[0].object.userData.object : null;
    },
  };
}

function volume(mesh) {
  const { width, height, depth } = mesh.geometry.parameters;
  return width * height * depth;
}
