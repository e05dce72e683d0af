// What programs do with meshes besides drawing them once: `features.mjs` calls these functions in the browser. Each resolves with pictures or
// numbers that must be alike, and one that must not.
import * as THREE from 'three';
import './page.js';

const SIZE = 256;
const { load, makeRenderer, meshesOf, pixels } = window.silmapTest;
const OPTIONS = { reuseErrorPx: 0 };

let renderer;
const sphereOf = (object) => {
  object.updateWorldMatrix(true, true);
  return new THREE.Box3().setFromObject(object).getBoundingSphere(new THREE.Sphere());
};

/** Objects in a scene, seen from as far away as `away` radii of a sphere; from the other side where `side` is −1. */
function sceneOf(sphere, objects, away = 2.9, side = 1) {
  const scene = new THREE.Scene().add(...objects);
  const camera = new THREE.PerspectiveCamera(45, 1, 0.01 * sphere.radius, 100 * sphere.radius);
  camera.position.set(side * 1.1, 0.9, 2.6).setLength(away * sphere.radius).add(sphere.center);
  camera.lookAt(sphere.center);
  return { scene, camera };
}

/** A picture with all outlines. */
async function shown({ scene, camera }, outlines, by = renderer) {
  by.render(scene, camera);
  for (const one of outlines) await one?.settled();
  by.render(scene, camera);
  return pixels(by, SIZE);
}

const outlinesOf = (...files) => files.map(({ userData }) => userData.silmap);
const plainOf = (mesh) => {
  const plain = new THREE.Mesh(mesh.geometry, mesh.plainMaterial);
  plain.matrixAutoUpdate = false;
  plain.matrix.copy(mesh.matrixWorld);
  return plain;
};

/** Two assets side by side, and each in a scene without the other: both must cover what each does alone. */
async function twoAssets(files) {
  const loaded = await Promise.all(files.map((file) => load(file, OPTIONS)));
  loaded.forEach(({ scene }, k) => {
    const { center, radius } = sphereOf(scene);
    scene.scale.setScalar(1 / radius);
    scene.position.copy(center).multiplyScalar(-1 / radius).add(new THREE.Vector3(2 * k - 1, 0, 0));
  });
  const sphere = new THREE.Sphere(new THREE.Vector3(), 2);
  const outlines = outlinesOf(...loaded);
  const alone = [];
  for (const { scene } of loaded) alone.push(await shown(sceneOf(sphere, [scene]), outlines));
  return { alone, both: await shown(sceneOf(sphere, loaded.map(({ scene }) => scene)), outlines) };
}

/** A node that mirrors and what it mirrors, from eyes that mirror each other: one picture is the other one turned over. */
async function mirrored(file) {
  const gltf = await load(file, OPTIONS);
  const node = new THREE.Group().add(gltf.scene);
  const pictures = [await shown(sceneOf(sphereOf(node), [node]), outlinesOf(gltf))];
  node.scale.x = -1;
  pictures.push(await shown(sceneOf(sphereOf(node), [node], 2.9, -1), outlinesOf(gltf)));
  return [...pictures, await shown(sceneOf(sphereOf(node), [plainOf(meshesOf(node)[0])], 2.9, -1), [])];
}

/** An eye within the sphere about the model, and the plain hull from there. */
async function inside(file) {
  const gltf = await load(file, OPTIONS);
  const [x, y, z, radius] = gltf.userData.silmap.sphere;
  const sphere = new THREE.Sphere(new THREE.Vector3(x, y, z), radius);
  const [mesh] = meshesOf(gltf.scene);
  return [await shown(sceneOf(sphere, [mesh], 0.9), outlinesOf(gltf)), await shown(sceneOf(sphere, [plainOf(mesh)], 0.9), [])];
}

/** What was loaded, its clone, and what a scene's JSON gives back. */
async function copies(file) {
  const gltf = await load(file, OPTIONS);
  const sphere = sphereOf(gltf.scene);
  const [mesh] = meshesOf(gltf.scene);
  const { clippedMaterial } = mesh;
  const original = await shown(sceneOf(sphere, [gltf.scene]), outlinesOf(gltf));
  const copy = await shown(sceneOf(sphere, [gltf.scene.clone()]), outlinesOf(gltf));
  const stored = JSON.parse(JSON.stringify(gltf.scene.toJSON()));
  const restored = await new THREE.ObjectLoader().parseAsync(stored);
  const plain = await shown(sceneOf(sphere, [plainOf(mesh)]), []);
  const parsed = await shown(sceneOf(sphere, [restored]), []);
  return { original, copy, plain, parsed, isKept: mesh.material === clippedMaterial };
}

/** A picture, the same after the context was lost and restored, and after another renderer drew in between. */
async function lostContext(file) {
  const gltf = await load(file, OPTIONS);
  const { scene, camera } = sceneOf(sphereOf(gltf.scene), [gltf.scene]);
  const outlines = outlinesOf(gltf);
  const before = await shown({ scene, camera }, outlines);
  const extension = renderer.getContext().getExtension('WEBGL_lose_context');
  const heard = (name) => new Promise((resolve) => renderer.domElement.addEventListener(name, resolve, { once: true }));
  const lost = heard('webglcontextlost');
  extension.loseContext();
  await lost;
  // Outlines that are made meanwhile.
  const place = camera.position.clone();
  camera.position.x *= 0.9;
  renderer.render(scene, camera);
  // A browser restores nothing before it has told of the loss.
  await new Promise((resolve) => setTimeout(resolve, 50));
  const restored = heard('webglcontextrestored');
  extension.restoreContext();
  await restored;
  await new Promise((resolve) => setTimeout(resolve, 100));
  camera.position.copy(place);
  return { before, after: await shown({ scene, camera }, outlines), plain: await shown({ scene: new THREE.Scene().add(plainOf(meshesOf(gltf.scene)[0])), camera }, []) };
}

/** Two renderers take turns, with new outlines at each. */
async function inTurns(file) {
  const gltf = await load(file, OPTIONS);
  const { scene, camera } = sceneOf(sphereOf(gltf.scene), [gltf.scene]);
  const outlines = outlinesOf(gltf);
  const other = await makeRenderer(SIZE);
  const place = camera.position.clone();
  const first = [];
  for (const by of [renderer, other, renderer, other]) {
    camera.position.copy(place);
    first.push(await shown({ scene, camera }, outlines, by));
    camera.position.applyAxisAngle(new THREE.Vector3(0, 1, 0), 0.3 * first.length);
    camera.lookAt(scene.position);
    await shown({ scene, camera }, outlines, by);
    camera.position.copy(place);
    camera.lookAt(sphereOf(gltf.scene).center);
  }
  other.dispose();
  return first;
}

/** Loads, draws and lets go, over and over; memory after some and after all of it. */
async function reload(file, [early, late]) {
  const target = { heap: [], worker: [], geometries: [], textures: [] };
  for (let k = 1; k <= late; k++) {
    const gltf = await load(file);
    const made = sceneOf(sphereOf(gltf.scene), [gltf.scene]);
    await shown(made, outlinesOf(gltf));
    const { silmap } = gltf.userData;
    if (k === early || k === late) {
      await new Promise((resolve) => setTimeout(resolve, 300));
      globalThis.gc?.();
      target.heap.push(performance.memory.usedJSHeapSize);
      target.worker.push(silmap.memory.buffer.byteLength + await silmap.workerMemory());
    }
    for (const mesh of meshesOf(gltf.scene)) {
      mesh.geometry.dispose();
      mesh.plainMaterial.map?.dispose();
      mesh.plainMaterial.dispose();
      mesh.dispose();
    }
    silmap.dispose();
    if (k === early || k === late) {
      target.geometries.push(renderer.info.memory.geometries);
      target.textures.push(renderer.info.memory.textures);
    }
  }
  return target;
}

/** Which meshes of a file are clipped, by their names. */
async function names(file) {
  const gltf = await load(file);
  return gltf.scenes.map((scene) => meshesOf(scene).map((mesh) => [mesh.name, mesh.isSilmapMesh === true]));
}

const uses = { twoAssets, mirrored, inside, copies, lostContext, inTurns, reload, names };

/** Runs one of them. */
window.silmapTest.use = async (name, ...given) => {
  renderer ??= await makeRenderer(SIZE);
  return uses[name](...given);
};
