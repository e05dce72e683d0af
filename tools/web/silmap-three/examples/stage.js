// What the pages share: a renderer, the asset, the full mesh, light, and a camera that arrow keys move as well.
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

export const parameters = new URLSearchParams(location.search);
export const isGpu = parameters.get('renderer') === 'webgpu';
const message = document.getElementById('message');
const picture = document.getElementById('picture');

export const say = (text) => {
  message.textContent = text;
};

/** The package: only pages that draw assets fetch it. */
export const loadPackage = () => import(isGpu ? 'silmap-three/webgpu' : 'silmap-three');

export async function makeRenderer() {
  let renderer;
  if (isGpu) {
    const { WebGPURenderer } = await import('three/webgpu');
    renderer = new WebGPURenderer({ antialias: true });
    await renderer.init();
    // For a machine without a display, whose canvas shows nothing.
    if (parameters.has('offscreen')) renderer.setOutputRenderTarget(new THREE.RenderTarget(picture.clientWidth, picture.clientHeight, { samples: 4 }));
  } else {
    renderer = new THREE.WebGLRenderer({ antialias: true });
  }
  renderer.domElement.tabIndex = 0;
  renderer.domElement.setAttribute('aria-label', 'The picture. Arrow keys turn it, plus and minus move nearer and farther.');
  picture.append(renderer.domElement);
  return renderer;
}

/** Fits the picture to the window, now and later. */
export function fitToWindow(renderer, camera) {
  const fit = () => {
    const { clientWidth: width, clientHeight: height } = picture;
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setSize(width, height);
    camera.aspect = width / Math.max(height, 1);
    camera.updateProjectionMatrix();
  };
  new ResizeObserver(fit).observe(picture);
  fit();
}

/** Turns the camera about its target by mouse, touch and keys. */
export function steer(camera, renderer, target) {
  const controls = new OrbitControls(camera, renderer.domElement);
  controls.target.copy(target);
  controls.update();
  const turn = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  renderer.domElement.addEventListener('keydown', (event) => {
    const arm = camera.position.clone().sub(controls.target);
    const place = new THREE.Spherical().setFromVector3(arm);
    if (event.key in turn) {
      place.theta += 0.06 * turn[event.key][0];
      place.phi = Math.min(Math.max(place.phi + 0.06 * turn[event.key][1], 0.05), Math.PI - 0.05);
    } else if (event.key === '+' || event.key === '-') {
      place.radius *= event.key === '+' ? 0.9 : 1 / 0.9;
    } else {
      return;
    }
    event.preventDefault();
    camera.position.copy(controls.target).add(arm.setFromSpherical(place));
    controls.update();
  });
  return controls;
}

/** Loads a file; what goes wrong is told with its address. */
async function loadFrom(loader, url) {
  try {
    return await loader.loadAsync(url);
  } catch (error) {
    throw new Error(`${url} cannot be read: ${error.message}`);
  }
}

/** The first mesh of what was loaded from an address. */
function firstMesh(loaded, url) {
  let mesh;
  loaded?.traverse((object) => {
    if (object.isMesh) mesh ??= object;
  });
  if (!mesh) throw new Error(`${url} shows no mesh`);
  return mesh;
}

/** The asset's hull: clipped by the package, or as any program shows it. */
export async function loadHull({ SilmapExtension }, options = {}) {
  const url = parameters.get('asset');
  if (!url) throw new Error('the address needs an asset: ?asset=/asset.glb');
  const loader = new GLTFLoader();
  loader.register((parser) => new SilmapExtension(parser, options));
  const gltf = await loadFrom(loader, url);
  return { hull: firstMesh(gltf.scene, url), outlines: gltf.userData.silmap };
}

/** The full mesh, in the colour of what has none. */
export async function loadModel() {
  const url = parameters.get('model');
  if (!url) return null;
  const material = new THREE.MeshLambertMaterial({ color: new THREE.Color(0.62, 0.58, 0.52) });
  const loaders = {
    ply: async () => (await import('three/addons/loaders/PLYLoader.js')).PLYLoader,
    obj: async () => (await import('three/addons/loaders/OBJLoader.js')).OBJLoader,
    glb: async () => GLTFLoader,
  };
  const kind = url.split('.').pop().toLowerCase();
  if (!loaders[kind]) throw new Error('the full mesh may be .ply, .obj or .glb');
  const loaded = await loadFrom(new (await loaders[kind]())(), url);
  if (loaded.isBufferGeometry) {
    // Devices have no numbers of double precision.
    for (const attribute of Object.values(loaded.attributes)) {
      if (attribute.array instanceof Float64Array) attribute.array = Float32Array.from(attribute.array);
    }
    if (!loaded.attributes.normal) loaded.computeVertexNormals();
    if (loaded.attributes.color) Object.assign(material, { vertexColors: true, color: new THREE.Color(1, 1, 1) });
    return new THREE.Mesh(loaded, material);
  }
  return firstMesh(kind === 'glb' ? loaded.scene : loaded, url);
}

/** The studio light that assets are painted in, for the full mesh. */
export function studioLight() {
  const lights = [new THREE.AmbientLight(0xffffff, 0.22 * Math.PI)];
  for (const [x, y, z, share] of [[0.45, 0.75, 0.55, 0.62], [-0.7, 0.15, -0.35, 0.3]]) {
    const light = new THREE.DirectionalLight(0xffffff, share * Math.PI);
    light.position.set(x, y, z);
    lights.push(light);
  }
  return lights;
}

/** Starts a page; what goes wrong is told on it. */
export async function start(page) {
  try {
    await page();
  } catch (error) {
    say(`This does not work: ${error.message}`);
    throw error;
  }
}
