// How a program uses the package, for the compiler: `npx tsc --noEmit -p test`.
import { PerspectiveCamera, Scene, WebGLRenderer } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { Outlines, SilmapExtension, SilmapInstancedMesh, SilmapMesh } from 'silmap-three';

export async function show(renderer: WebGLRenderer, scene: Scene, camera: PerspectiveCamera): Promise<void> {
  const loader = new GLTFLoader();
  loader.register((parser) => new SilmapExtension(parser, { reuseErrorPx: 0.5, lit: true }));
  const gltf = await loader.loadAsync('asset.glb');
  const outlines: Outlines | undefined = gltf.userData.silmap;
  gltf.scene.traverse((object) => {
    if (object instanceof SilmapMesh) scene.add(new SilmapInstancedMesh(object, 500));
  });
  renderer.render(scene, camera);
  await outlines?.settled();
  // @ts-expect-error there is no such option
  new SilmapExtension(gltf.parser, { outlines: 3 });
}
