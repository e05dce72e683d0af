// Assets of silmap in three.js, by WebGPURenderer (and by WebGLRenderer too).
import { clipByNodes } from './clip-nodes.js';
import { setNodes } from './mesh.js';

setNodes(clipByNodes);

export * from './index.js';
