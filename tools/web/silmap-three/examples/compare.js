// One picture, two halves: the clipped hull to the left of a border, the plain hull or the full mesh to its right.
//
// Address: `?asset=ASSET.glb`, and `&model=MODEL.ply` for the full mesh, `&renderer=webgpu`.
import * as THREE from 'three';
import { fitToWindow, isGpu, loadHull, loadModel, loadPackage, makeRenderer, parameters, say, start, steer, studioLight } from './stage.js';

const byId = (id) => document.getElementById(id);

const triangles = ({ index, attributes }) => (index ?? attributes.position).count / 3;

start(async () => {
  const other = new URLSearchParams(parameters);
  other.set('renderer', isGpu ? 'webgl' : 'webgpu');
  byId('other').href = `?${other}`;
  byId('other').textContent = isGpu ? 'WebGL' : 'WebGPU';

  const [renderer, silmap] = await Promise.all([makeRenderer(), loadPackage()]);
  const { hull, outlines } = await loadHull(silmap);
  const model = await loadModel();
  const sceneOf = (...objects) => {
    const scene = new THREE.Scene();
    scene.background = new THREE.Color(0x2a2f36);
    scene.add(...objects);
    return scene;
  };
  const left = sceneOf(hull);
  const right = new Map();
  if (model) right.set(`the full mesh, ${triangles(model.geometry).toLocaleString('en')} triangles`, sceneOf(model, ...studioLight()));
  right.set(`the plain hull, ${triangles(hull.geometry).toLocaleString('en')} triangles`, sceneOf(new THREE.Mesh(hull.geometry, hull.plainMaterial ?? hull.material)));
  for (const name of right.keys()) byId('what').add(new Option(name));

  hull.geometry.computeBoundingSphere();
  const { center, radius } = hull.geometry.boundingSphere;
  const camera = new THREE.PerspectiveCamera(35, 1, 0.02 * radius, 100 * radius);
  fitToWindow(renderer, camera);
  // As far away as a window that is narrow needs.
  camera.position.set(0.9, 0.7, 3.4).multiplyScalar(radius / Math.min(camera.aspect, 1)).add(center);
  const controls = steer(camera, renderer, center);
  controls.autoRotateSpeed = 4;
  const line = document.createElement('div');
  line.style.cssText = 'position: absolute; top: 0; bottom: 0; width: 2px; background: #ffd24d; pointer-events: none';
  byId('picture').append(line);

  renderer.setScissorTest(true);
  const size = new THREE.Vector2();
  const draw = () => {
    controls.autoRotate = byId('turns').checked;
    controls.update();
    renderer.getSize(size);
    const border = Math.round((size.x * byId('border').value) / 100);
    line.style.left = `${border - 1}px`;
    const halves = [[left, 0, border], [right.get(byId('what').value), border, size.x - border]];
    for (const [scene, at, width] of halves) {
      if (width <= 0) continue;
      renderer.setScissor(at, 0, width, size.y);
      renderer.render(scene, camera);
    }
  };
  renderer.setAnimationLoop(draw);
  say(outlines
    ? `Left of the border: the hull of ${triangles(hull.geometry).toLocaleString('en')} triangles, clipped to its outline.`
    : 'Left of the border: the plain hull, for the silhouettes of this file are missing or damaged.');
  window.silmapReady = true;
});
