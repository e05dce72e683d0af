// Many instances that roam over a field, each clipped to its own outline, with shadows, fog and tone mapping.
//
// Address: `?asset=ASSET.glb`, and `&model=MODEL.ply` for the full mesh, `&what=mesh` to begin with it, `&renderer=webgpu`, `&count=N`.
import * as THREE from 'three';
import { fitToWindow, isGpu, loadHull, loadModel, loadPackage, makeRenderer, parameters, say, start, steer } from './stage.js';

const SKY = 0xa9bccd;
const byId = (id) => document.getElementById(id);
const times = { start: performance.now() };

/** Where instances are; they walk ahead and turn a little, and back where the field ends. Lengths are radii of the model. */
class Herd {
  constructor(most, { center, radius }) {
    this.radius = radius;
    this.toMiddle = new THREE.Matrix4().makeTranslation(-center.x, -center.y, -center.z);
    this.field = 1.6 * Math.sqrt(most);
    let seed = 1;
    const random = () => {
      // Numbers of Lehmer: the same on every machine.
      seed = (seed * 48271) % 0x7fffffff;
      return seed / 0x7fffffff;
    };
    this.random = random;
    this.members = Array.from({ length: most }, (_, k) => {
      const [away, angle] = [this.field * Math.sqrt((k + 0.5) / most), 2.39996323 * k];
      return { x: away * Math.cos(angle), z: away * Math.sin(angle), heading: 6.283 * random(), turn: 0, scale: 0.7 + 0.6 * random() };
    });
  }

  walk(seconds) {
    for (const member of this.members) {
      member.turn += (this.random() - 0.5 - 0.3 * member.turn) * seconds * 4;
      if (Math.hypot(member.x, member.z) > this.field) member.turn = 1.5;
      member.heading += member.turn * seconds;
      member.x += Math.sin(member.heading) * seconds * 0.8;
      member.z += Math.cos(member.heading) * seconds * 0.8;
    }
  }

  place(mesh, count) {
    const { radius } = this;
    const [matrix, up] = [new THREE.Matrix4(), new THREE.Vector3(0, 1, 0)];
    const [at, turn, size] = [new THREE.Vector3(), new THREE.Quaternion(), new THREE.Vector3()];
    this.members.slice(0, count).forEach(({ x, z, heading, scale }, k) => {
      at.set(x * radius, (scale - 1) * 0.75 * radius, z * radius);
      matrix.compose(at, turn.setFromAxisAngle(up, heading), size.setScalar(scale));
      mesh.setMatrixAt(k, matrix.multiply(this.toMiddle));
    });
    mesh.count = count;
    mesh.instanceMatrix.needsUpdate = true;
  }
}

function makeScene(radius) {
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(SKY);
  scene.fog = new THREE.Fog(SKY, 12 * radius, 70 * radius);
  const sun = new THREE.DirectionalLight(0xfff4e0, 2.4);
  sun.position.set(20, 34, 16).multiplyScalar(radius);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  sun.shadow.bias = -0.001;
  const reach = 40 * radius;
  Object.assign(sun.shadow.camera, { left: -reach, right: reach, top: reach, bottom: -reach, near: radius, far: 100 * radius });
  const ground = new THREE.Mesh(new THREE.CircleGeometry(150 * radius, 48), new THREE.MeshStandardMaterial({ color: 0x77805a, roughness: 1 }));
  ground.rotation.x = -Math.PI / 2;
  ground.position.y = -0.75 * radius;
  ground.receiveShadow = true;
  scene.add(new THREE.HemisphereLight(0xdde8ff, 0x6a6a50, 1.4), sun, ground);
  return { scene, sun };
}

start(async () => {
  const most = Number(byId('count').max);
  const first = parameters.get('what');
  byId('count').value = parameters.get('count') ?? 500;
  byId('shadows').checked = parameters.get('shadows') !== 'no';
  const other = new URLSearchParams(parameters);
  other.set('renderer', isGpu ? 'webgl' : 'webgpu');
  byId('other').href = `?${other}`;
  byId('other').textContent = isGpu ? 'WebGL' : 'WebGPU';

  const renderer = await makeRenderer();
  renderer.toneMapping = THREE.ACESFilmicToneMapping;
  renderer.shadowMap.enabled = true;
  // Whoever begins with the full mesh fetches nothing else.
  let [outlines, hull, unclipped] = [null, null, ''];
  const meshes = new Map();
  if (first !== 'mesh') {
    const silmap = await loadPackage();
    ({ hull, outlines } = await loadHull(silmap, { lit: true, outlineBytes: 16 << 20 }));
    if (outlines) meshes.set('Clipped hulls', new silmap.SilmapInstancedMesh(hull, most));
    else unclipped = '; plain hulls, for the silhouettes of this file are missing or damaged';
    meshes.set('Plain hulls', new THREE.InstancedMesh(hull.geometry, hull.plainMaterial ?? hull.material, most));
  }
  const model = first === 'plain' ? null : await loadModel();
  if (model) meshes.set('Full meshes', new THREE.InstancedMesh(model.geometry, model.material, most));
  if (meshes.size === 0) throw new Error('the address needs an asset or a model');

  const { geometry } = hull ?? model;
  geometry.computeBoundingSphere();
  const sphere = geometry.boundingSphere;
  const herd = new Herd(most, sphere);
  const { scene, sun } = makeScene(sphere.radius);
  for (const [name, mesh] of meshes) {
    mesh.castShadow = mesh.receiveShadow = true;
    mesh.frustumCulled = false;
    scene.add(mesh);
    byId('what').add(new Option(name));
  }
  if (first === 'mesh') byId('what').value = 'Full meshes';
  if (first === 'plain') byId('what').value = 'Plain hulls';

  const camera = new THREE.PerspectiveCamera(42, 1, 0.1 * sphere.radius, 400 * sphere.radius);
  camera.position.set(9, 7, 15).multiplyScalar(sphere.radius);
  fitToWindow(renderer, camera);
  const controls = steer(camera, renderer, new THREE.Vector3(0, 0, 0));

  let [last, frames, since] = [performance.now(), 0, performance.now()];
  const draw = (now) => {
    const seconds = Math.min((now - last) / 1000, 0.05);
    last = now;
    const count = Number(byId('count').value);
    byId('counted').value = count;
    if (byId('roams').checked) herd.walk(seconds);
    controls.update();
    sun.castShadow = byId('shadows').checked;
    for (const [name, mesh] of meshes) {
      mesh.visible = name === byId('what').value;
      if (mesh.visible) herd.place(mesh, count);
    }
    renderer.render(scene, camera);
    if (times.first === undefined) {
      times.first = performance.now();
      outlines?.settled().then(() => {
        times.clipped = performance.now();
      });
    }
    frames += 1;
    if (now - since > 1000) {
      const made = outlines ? `, ${outlines.cells.count()} outlines kept, ${outlines.made} made` : unclipped;
      say(`${((now - since) / frames).toFixed(0)} ms a picture${made}`);
      [frames, since] = [0, now];
    }
  };
  renderer.setAnimationLoop(draw);

  const memory = async () => {
    globalThis.gc?.();
    const { usedJSHeapSize } = performance.memory ?? {};
    return {
      heap: usedJSHeapSize, wasm: outlines?.memory.buffer.byteLength ?? 0, worker: (await outlines?.workerMemory()) ?? 0,
      outlines: outlines?.texels.byteLength ?? 0, geometries: renderer.info.memory.geometries, textures: renderer.info.memory.textures,
    };
  };
  /** Resolves when the device has drawn. */
  const finish = async () => {
    if (renderer.backend?.device) await renderer.backend.device.queue.onSubmittedWorkDone();
    const context = renderer.isWebGLRenderer && renderer.getContext();
    context?.readPixels?.(0, 0, 1, 1, context.RGBA, context.UNSIGNED_BYTE, new Uint8Array(4));
  };
  // For who drives the page by a script: draws so many frames, or for so long, and says what they took, in milliseconds, and what memory is
  // in use.
  window.silmapBench = async (count, mostMillis = Infinity) => {
    const before = await memory();
    const madeBefore = outlines?.made ?? 0;
    renderer.setAnimationLoop(null);
    const [whole, cpu] = [[], []];
    const end = performance.now() + mostMillis;
    for (let k = 0; k < count && performance.now() < end; k++) {
      const from = performance.now();
      draw(last + 1000 / 60);
      cpu.push(performance.now() - from);
      await finish();
      whole.push(performance.now() - from);
      // For what the worker has to say.
      await new Promise((resolve) => setTimeout(resolve));
    }
    renderer.setAnimationLoop(draw);
    const middle = (numbers) => numbers.sort((a, b) => a - b)[numbers.length >> 1];
    return {
      frame: middle(whole), cpu: middle(cpu), frames: whole.length,
      made: (outlines?.made ?? 0) - madeBefore, before, after: await memory(), times,
    };
  };
  times.ready = performance.now();
});
