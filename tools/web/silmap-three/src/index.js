// Assets of silmap in three.js, by WebGLRenderer. For WebGPURenderer import `silmap-three/webgpu`.
export { SilmapExtension } from './extension.js';
export { SilmapInstancedMesh, SilmapMesh } from './mesh.js';
export { Outlines } from './outlines.js';
