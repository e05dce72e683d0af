// For the command of glTF-Transform: `gltf-transform optimize IN.glb OUT.glb --config tools/web/gltf-transform.config.mjs`.
import { ALL_EXTENSIONS } from '@gltf-transform/extensions';
import { SilhouetteMapExtension } from './silhouette-map.mjs';

export default { extensions: [...ALL_EXTENSIONS, SilhouetteMapExtension] };
