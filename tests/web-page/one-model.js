// One model by three.js in a picture that fills the page: an asset that silmap-three clips, or a full mesh. `figures.mjs` measures it.
//
// Address: `?asset=ASSET.glb` or `?model=MODEL.ply`, and `&renderer=webgpu`.
import * as THREE from 'three';

const parameters = new URLSearchParams(location.search);
const isGpu = parameters.get('renderer') === 'webgpu';

async function load() {
  if (parameters.has('model')) {
    const { PLYLoader } = await import('three/addons/loaders/PLYLoader.js');
    const geometry = await new PLYLoader().loadAsync(parameters.get('model'));
    // Devices have no numbers of double precision.
    for (const attribute of Object.values(geometry.attributes)) {
      if (attribute.array instanceof Float64Array) attribute.array = Float32Array.from(attribute.array);
    }
    if (!geometry.attributes.normal) geometry.computeVertexNormals();
    return { object: new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ color: 0x9e9484 })), geometry };
  }
  const [{ GLTFLoader }, { SilmapExtension }] = await Promise.all([
    import('three/addons/loaders/GLTFLoader.js'), import(isGpu ? 'silmap-three/webgpu' : 'silmap-three'),
  ]);
  const gltf = await new GLTFLoader().register((parser) => new SilmapExtension(parser, { reuseErrorPx: 0 })).loadAsync(parameters.get('asset'));
  return { object: gltf.scene, geometry: gltf.scene.getObjectByProperty('isMesh', true).geometry, outlines: gltf.userData.silmap };
}

async function makeRenderer() {
  const renderer = isGpu ? new THREE.WebGPURenderer({ antialias: true }) : new THREE.WebGLRenderer({ antialias: true });
  await renderer.init?.();
  renderer.setSize(innerWidth, innerHeight);
  document.body.append(renderer.domElement);
  return renderer;
}

const [renderer, { object, geometry, outlines }] = await Promise.all([makeRenderer(), load()]);
const scene = new THREE.Scene().add(object, new THREE.HemisphereLight(0xffffff, 0x777766, 3));
geometry.computeBoundingSphere();
const { center, radius } = geometry.boundingSphere;
const camera = new THREE.PerspectiveCamera(35, innerWidth / innerHeight, 0.1 * radius, 20 * radius);

/** Resolves when the device has drawn. */
async function finish() {
  if (isGpu) return renderer.backend.device.queue.onSubmittedWorkDone();
  const context = renderer.getContext();
  return context.readPixels(0, 0, 1, 1, context.RGBA, context.UNSIGNED_BYTE, new Uint8Array(4));
}

const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));

/** Draws a picture with its own outline. Milliseconds until it was handed to the device, of these the page's thread, and until it was drawn. */
async function picture(angle) {
  camera.position.set(4 * Math.sin(angle), 1, 4 * Math.cos(angle)).multiplyScalar(radius).add(center);
  camera.lookAt(center);
  const since = performance.now();
  let thread = 0;
  const draw = async () => {
    await frame();
    const from = performance.now();
    renderer.render(scene, camera);
    thread += performance.now() - from;
  };
  await draw();
  if (outlines) {
    await outlines.settled();
    await draw();
  }
  const whole = performance.now() - since;
  await finish();
  return { whole, thread, drawn: performance.now() - since };
}

await picture(0);
const first = performance.now();

/** Times of one turn, the mean of its pictures, and bytes of the modules. */
window.measure = async (count) => {
  const found = { first, whole: 0, thread: 0, drawn: 0, memory: outlines ? outlines.memory.buffer.byteLength + await outlines.workerMemory() : 0 };
  for (let k = 0; k < count; k++) {
    const times = await picture((2 * Math.PI * k) / count);
    for (const [name, millis] of Object.entries(times)) found[name] += millis / count;
  }
  return found;
};
