// What a test draws: `compare.mjs` calls these functions in the browser.
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { PLYLoader } from 'three/addons/loaders/PLYLoader.js';

const parameters = new URLSearchParams(location.search);
const isGpu = parameters.get('renderer') === 'webgpu';
if (parameters.has('no-worker')) delete globalThis.Worker;
const silmap = await import(isGpu ? 'silmap-three/webgpu' : 'silmap-three');

const warnings = [];
const { warn } = console;
console.warn = (...text) => {
  warnings.push(text.join(' '));
  warn(...text);
};

async function makeRenderer(size, { antialias = false } = {}) {
  let renderer;
  if (isGpu) {
    const { WebGPURenderer } = await import('three/webgpu');
    renderer = new WebGPURenderer({ antialias, alpha: true, forceWebGL: parameters.has('force-webgl') });
    await renderer.init();
    // Where there is no display, its canvas shows nothing.
    if (!parameters.has('force-webgl')) renderer.setOutputRenderTarget(new THREE.RenderTarget(size, size));
  } else {
    renderer = new THREE.WebGLRenderer({ antialias, alpha: true, preserveDrawingBuffer: true });
  }
  renderer.setSize(size, size);
  renderer.setClearColor(0x000000, 0);
  document.body.append(renderer.domElement);
  return renderer;
}

/** Loads an asset with the extension, or as any program would. */
async function load(file, options = {}) {
  const loader = new GLTFLoader();
  if (options.plain !== true) loader.register((parser) => new silmap.SilmapExtension(parser, options));
  return loader.loadAsync(file);
}

const meshesOf = (object) => {
  const found = [];
  object.traverse((child) => child.isMesh && found.push(child));
  return found;
};

let renderer;
let scene;
const models = new Map();

/** Draws a model from an eye and returns the pixels, top row first, as base64. */
async function draw({ file, size, eye, target, fov, far = 1000, options = {}, antialias = false, orthographic, moved }) {
  renderer ??= await makeRenderer(size, { antialias });
  renderer.toneMapping = THREE.NoToneMapping;
  const key = JSON.stringify([file, options]);
  if (!models.has(key)) models.set(key, await load(file, options));
  const gltf = models.get(key);
  scene = new THREE.Scene();
  // What is in it may be anywhere, as long as the camera is there too.
  const place = new THREE.Group();
  if (moved) {
    place.rotation.set(0.7, -1.9, 0.4);
    place.scale.setScalar(2.5);
    place.position.set(3, -1, 8);
  }
  scene.add(place.add(gltf.scene));
  const camera = orthographic
    ? new THREE.OrthographicCamera(-orthographic, orthographic, orthographic, -orthographic, 0.001, 1000)
    : new THREE.PerspectiveCamera(fov, 1, far === 1000 ? 0.001 : 1, far);
  camera.position.fromArray(eye);
  camera.lookAt(...target);
  place.add(camera);
  // Once for the outlines, once with them.
  renderer.render(scene, camera);
  await gltf.userData?.silmap?.settled();
  renderer.render(scene, camera);
  return { pixels: await pixels(renderer, size), warnings: warnings.splice(0), clipped: meshesOf(gltf.scene).map((m) => m.isSilmapMesh === true) };
}

async function pixels(renderer, size) {
  const target = renderer.getOutputRenderTarget?.();
  if (target) return base64(new Uint8Array(await renderer.readRenderTargetPixelsAsync(target, 0, 0, size, size)));
  const { domElement } = renderer;
  const bitmap = await createImageBitmap(domElement);
  const canvas = new OffscreenCanvas(size, size);
  const context = canvas.getContext('2d', { willReadFrequently: true });
  context.drawImage(bitmap, 0, 0);
  return base64(context.getImageData(0, 0, size, size).data);
}

function base64(data) {
  let text = '';
  for (let at = 0; at < data.length; at += 4096) text += String.fromCharCode(...data.subarray(at, at + 4096));
  return btoa(text);
}

window.silmapTest = { draw, load, makeRenderer, meshesOf, pixels };

/** A deterministic number from 0 to 1. */
const random = (seed) => {
  const wave = Math.sin(seed * 127.1 + 311.7) * 43758.5453;
  return wave - Math.floor(wave);
};

/** A material with light and shadow for what stands beside hulls. */
const plainMaterial = (color) => new THREE.MeshStandardMaterial({ color, roughness: 1 });

/**
 * Draws a scene with a ground, a light that casts shadows, fog and tone mapping. `what` says what stands there: `mesh` (copies of the
 * clipped hull), `instanced` (the same in one mesh), `plain` (hulls as they are) or `full` (full meshes); with `shadowOnly` nothing but their
 * shadows shows.
 */
async function drawScene({
  file, size, what, count = 9, antialias = false, fog = true, shadows = true, light = 'directional', lit = true, eye, shadowOnly = false,
}) {
  renderer ??= await makeRenderer(size, { antialias });
  renderer.shadowMap.enabled = shadows;
  renderer.toneMapping = THREE.ACESFilmicToneMapping;
  const options = { reuseErrorPx: 0, lit, plain: what === 'plain' };
  const key = JSON.stringify([file, options]);
  if (!models.has(key)) models.set(key, await load(file, options));
  const gltf = models.get(key);
  const [hull] = meshesOf(gltf.scene);
  hull.geometry.computeBoundingSphere();
  const { center, radius } = hull.geometry.boundingSphere;
  scene = new THREE.Scene();
  scene.background = new THREE.Color(0x9fb4c8);
  if (fog) scene.fog = new THREE.Fog(0x9fb4c8, 4 * radius, 16 * radius);
  scene.add(new THREE.HemisphereLight(0xffffff, 0x777766, 1.2));
  const lamp = light === 'point' ? new THREE.PointLight(0xffffff, 60 * radius * radius, 0) : new THREE.DirectionalLight(0xffffff, 2.5);
  lamp.position.set(2, 5, 3).multiplyScalar(light === 'point' ? 0.9 * radius : 2 * radius);
  lamp.castShadow = true;
  lamp.shadow.mapSize.set(1024, 1024);
  lamp.shadow.bias = -0.002;
  Object.assign(lamp.shadow.camera, { near: 0.5 * radius, far: 40 * radius });
  if (light !== 'point') Object.assign(lamp.shadow.camera, { left: -6 * radius, right: 6 * radius, top: 6 * radius, bottom: -6 * radius });
  lamp.shadow.camera.updateProjectionMatrix();
  scene.add(lamp);
  const ground = new THREE.Mesh(new THREE.PlaneGeometry(60 * radius, 60 * radius), plainMaterial(0x8a8f70));
  ground.rotation.x = -Math.PI / 2;
  // With nothing but shadows there is room between the ground and the hull, which may reach below the model.
  ground.position.y = (shadowOnly ? -1.5 : -0.95) * radius;
  ground.receiveShadow = true;
  scene.add(ground);
  const matrices = Array.from({ length: count }, (_, k) => {
    const side = Math.ceil(Math.sqrt(count));
    const at = new THREE.Vector3((k % side) - (side - 1) / 2, 0, Math.floor(k / side) - (side - 1) / 2).multiplyScalar(2.4 * radius);
    const turn = new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(0, 1, 0), 6.28 * random(k));
    const scale = 0.7 + 0.5 * random(k + 50);
    at.y -= 0.95 * radius * (1 - scale);
    const moved = new THREE.Matrix4().compose(at, turn, new THREE.Vector3(scale, scale, scale));
    return moved.multiply(new THREE.Matrix4().makeTranslation(-center.x, -center.y, -center.z));
  });
  if (what === 'instanced') {
    hull.castShadow = hull.receiveShadow = true;
    const many = new silmap.SilmapInstancedMesh(hull, count);
    matrices.forEach((matrix, k) => many.setMatrixAt(k, matrix));
    scene.add(many.clone());
  } else {
    const full = what === 'full' && new THREE.Mesh(await new PLYLoader().loadAsync('/model.ply'), plainMaterial(0xc0bcb0));
    if (full) {
      // Devices have no numbers of double precision.
      full.geometry.attributes.position.array = Float32Array.from(full.geometry.attributes.position.array);
      full.geometry.computeVertexNormals();
    }
    for (const matrix of matrices) {
      const one = (full || hull).clone();
      if (what === 'plain' && lit) one.material = plainMaterial(0xc0bcb0);
      if (shadowOnly) Object.assign(one.material, { colorWrite: false, depthWrite: false });
      one.castShadow = one.receiveShadow = true;
      one.matrixAutoUpdate = false;
      one.matrix.copy(matrix);
      scene.add(one);
    }
  }
  const camera = new THREE.PerspectiveCamera(45, 1, 0.05 * radius, 100 * radius);
  camera.position.fromArray(eye ?? [4, 4.5, 8]).multiplyScalar(radius);
  camera.lookAt(0, 0, 0);
  renderer.render(scene, camera);
  await gltf.userData?.silmap?.settled();
  renderer.render(scene, camera);
  const shown = await pixels(renderer, size);
  return { pixels: shown, warnings: warnings.splice(0), calls: renderer.info.render.calls ?? renderer.info.render.drawCalls };
}

Object.assign(window.silmapTest, { drawScene });
