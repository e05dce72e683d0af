// Types of `silmap-three/webgpu`.
export * from './index.js';
