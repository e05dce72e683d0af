// Tells GLTFLoader of the extension: what is clipped then, and what is not because something is amiss.
import { LoaderUtils, MeshStandardMaterial, Vector4 } from 'three';
import { SilmapMesh } from './mesh.js';
import { Outlines } from './outlines.js';

export const NAME = 'SILMAP_silhouette_map';
const TRACE = 'silmap';
const GLB = 'KHR_binary_glTF';
const HEADER = 12;
const CHUNK_HEADER = 8;
const JSON_CHUNK = 0x4e4f534a;
const BINARY_CHUNK = 0x004e4942;

/** The file that the loader has taken apart, put together again. */
function binaryFile(text, body) {
  const json = new TextEncoder().encode(text);
  const pad = (n) => (n + 3) & ~3;
  const length = HEADER + CHUNK_HEADER + pad(json.length) + (body ? CHUNK_HEADER + pad(body.byteLength) : 0);
  const bytes = new Uint8Array(length);
  const view = new DataView(bytes.buffer);
  bytes.set([0x67, 0x6c, 0x54, 0x46]);
  view.setUint32(4, 2, true);
  view.setUint32(8, length, true);
  view.setUint32(HEADER, pad(json.length), true);
  view.setUint32(HEADER + 4, JSON_CHUNK, true);
  bytes.fill(0x20, HEADER + CHUNK_HEADER, HEADER + CHUNK_HEADER + pad(json.length));
  bytes.set(json, HEADER + CHUNK_HEADER);
  if (body) {
    const at = HEADER + CHUNK_HEADER + pad(json.length);
    view.setUint32(at, pad(body.byteLength), true);
    view.setUint32(at + 4, BINARY_CHUNK, true);
    bytes.set(new Uint8Array(body), at + CHUNK_HEADER);
  }
  return bytes;
}

/** The bytes of what is named beside a document. */
async function loadBeside({ fileLoader, options }, name) {
  return new Uint8Array(await fileLoader.loadAsync(LoaderUtils.resolveURL(name, options.path)));
}

function base64(bytes) {
  let text = '';
  for (let at = 0; at < bytes.length; at += 8192) text += String.fromCharCode(...bytes.subarray(at, at + 8192));
  return btoa(text);
}

/** The file, and the buffers that it names; pictures beside it are put into it. */
async function readFile(parser) {
  const { json } = parser;
  const isBeside = ({ uri }) => uri !== undefined && !uri.startsWith('data:');
  const names = [...new Set((json.buffers ?? []).filter(isBeside).map(({ uri }) => uri))];
  const files = await Promise.all(names.map((name) => loadBeside(parser, name)));
  const glb = parser.extensions[GLB];
  if (glb && !json.images?.some(isBeside)) return { file: binaryFile(glb.content, glb.body), names, files };
  const embed = async (image) => isBeside(image) ? { ...image, uri: `data:;base64,${base64(await loadBeside(parser, image.uri))}` } : image;
  const text = JSON.stringify({ ...JSON.parse(glb?.content ?? JSON.stringify(json)), images: await Promise.all((json.images ?? []).map(embed)) });
  return { file: glb ? binaryFile(text, glb.body) : new TextEncoder().encode(text), names, files };
}

/** What moves and scales vertices to the map's coordinates: something where positions were quantised, and their node moves them back. */
function fromMesh(geometry, accessor) {
  const { position } = geometry.attributes;
  const identity = new Vector4(0, 0, 0, 1);
  if (position.array instanceof Float32Array || !accessor?.min || !accessor.max) return identity;
  geometry.computeBoundingBox();
  const { min, max } = geometry.boundingBox;
  const [low, high] = [accessor.min, accessor.max];
  const axis = [0, 1, 2].reduce((most, k) => (high[k] - low[k] > high[most] - low[most] ? k : most), 0);
  const scale = (high[axis] - low[axis]) / (max.getComponent(axis) - min.getComponent(axis));
  return new Vector4(low[0] - scale * min.x, low[1] - scale * min.y, low[2] - scale * min.z, scale);
}

/** The material with light and shadow where the file's own has none: an asset's is unlit. */
async function litMaterial(parser, material) {
  const lit = new MeshStandardMaterial({ name: material.name, map: material.map, roughness: 1, metalness: 0 });
  const at = parser.associations.get(material)?.materials ?? 0;
  const normals = parser.json.materials?.[at]?.normalTexture;
  if (normals) await parser.assignTexture(lit, 'normalMap', normals);
  return lit;
}

/**
 * The plugin: `new GLTFLoader().register((parser) => new SilmapExtension(parser))`. Meshes of an asset become `SilmapMesh`. Where the
 * extension is not there the file is like any other; where it is damaged, or outlines cannot be made, the plain hull shows.
 */
export class SilmapExtension {
  constructor(parser, options = {}) {
    this.name = NAME;
    this.parser = parser;
    this.options = options;
  }

  async afterRoot(result) {
    const { parser, options } = this;
    const extension = parser.json.extensions?.[NAME];
    if (!extension) return;
    try {
      const outlines = await Outlines.read(await readFile(parser), options);
      const accessor = parser.json.accessors?.[extension.hull?.positionsAccessor];
      for (const hull of this.#hullsOf(result.scenes)) {
        const material = options.lit ? await litMaterial(parser, hull.material) : hull.material;
        this.#replace(hull, new SilmapMesh(hull.geometry, material, outlines, fromMesh(hull.geometry, accessor)));
      }
      result.userData.silmap = outlines;
    } catch (error) {
      console.warn(`silmap-three: the plain hull is shown, for its outlines cannot be used: ${error.message}`);
    }
  }

  /** The hull wherever scenes show it, beside what else they do: by its mark, or else the first mesh. */
  #hullsOf(scenes) {
    const meshes = [];
    for (const scene of scenes) scene.traverse((object) => object.isMesh && !object.isSkinnedMesh && meshes.push(object));
    const marked = meshes.filter(({ userData }) => userData[TRACE] === NAME);
    return marked.length > 0 ? marked : meshes.filter((mesh) => this.parser.associations.get(mesh)?.meshes === 0);
  }

  #replace(hull, mesh) {
    const { parent, children, name, userData, visible } = hull;
    Object.assign(mesh, { name, userData, visible, matrixAutoUpdate: hull.matrixAutoUpdate });
    mesh.position.copy(hull.position);
    mesh.quaternion.copy(hull.quaternion);
    mesh.scale.copy(hull.scale);
    mesh.matrix.copy(hull.matrix);
    for (const child of [...children]) mesh.add(child);
    parent.children[parent.children.indexOf(hull)] = mesh;
    mesh.parent = parent;
    hull.parent = null;
    const association = this.parser.associations.get(hull);
    if (association) this.parser.associations.set(mesh, association);
  }
}
