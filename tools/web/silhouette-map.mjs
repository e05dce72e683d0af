// Keeps the silhouette map of silmap assets when glTF-Transform reads a file and writes it again.
//
// Everything that the extension refers to is held as bytes: no transform changes it. Register `SilhouetteMapExtension` with the
// reader and writer: `new NodeIO().registerExtensions([...ALL_EXTENSIONS, SilhouetteMapExtension])`, or for its command
// `gltf-transform optimize IN.glb OUT.glb --config gltf-transform.config.mjs`.
import { Extension, ExtensionProperty, PropertyType } from '@gltf-transform/core';

const NAME = 'SILMAP_silhouette_map';
const KINDS = [[/View$/, 'view'], [/Accessor$/, 'accessor'], [/^(image|images|normals)$/, 'image']];
const kindOf = (key) => KINDS.find(([pattern]) => pattern.test(key))?.[1];
const isSame = (a, b) => a.length === b.length && a.every((byte, i) => byte === b[i]);
const bytesOf = (array) => new Uint8Array(array.buffer, array.byteOffset, array.byteLength);

/** The value with every index replaced by what `visit` makes of it; what builds wrote down as `params` has none. */
function replaceIndices(value, kind, visit) {
  if (Array.isArray(value)) return value.map((item) => replaceIndices(item, kind, visit));
  if (typeof value === 'number' && kind) return visit(kind, value);
  if (value === null || typeof value !== 'object') return value;
  const entries = Object.entries(value);
  return Object.fromEntries(entries.map(([k, v]) => [k, k === 'params' ? v : replaceIndices(v, kindOf(k), visit)]));
}

/** The extension's JSON with indices into `parts`, each of them bytes and what describes them. */
class SilhouetteMap extends ExtensionProperty {
  static EXTENSION_NAME = NAME;
  init() {
    Object.assign(this, { extensionName: NAME, propertyType: 'SilhouetteMap', parentTypes: [PropertyType.ROOT] });
  }
  getDefaults() {
    return Object.assign(super.getDefaults(), { json: {}, parts: [] });
  }
}

export class SilhouetteMapExtension extends Extension {
  static EXTENSION_NAME = NAME;
  extensionName = NAME;
  prewriteTypes = [PropertyType.BUFFER];

  read(context) {
    const { json, resources } = context.jsonDoc;
    const definition = json.extensions?.[NAME];
    if (!definition) return this;
    const parts = [];
    const read = {
      view: (i) => ({ bytes: context.bufferViews[i].slice() }),
      image: (i) => {
        const { bufferView, uri, ...image } = json.images[i];
        return { image, bytes: (bufferView === undefined ? resources[uri] : context.bufferViews[bufferView]).slice() };
      },
      accessor: (i) => {
        const own = context.accessors[i];
        const { type, componentType, count, min, max } = json.accessors[i];
        return { own, accessor: { type, componentType, count, min, max }, bytes: bytesOf(own.getArray()).slice() };
      },
    };
    const map = new SilhouetteMap(this.document.getGraph());
    map.set('json', replaceIndices(definition, null, (kind, i) => parts.push(read[kind](i)) - 1)).set('parts', parts);
    this.document.getRoot().setExtension(NAME, map);
    for (const i of definition.textures?.images ?? []) context.textures[i].dispose();
    return this;
  }

  /** Puts the bytes of parts into the first buffer, but for those that the document has anyway. */
  prewrite(context) {
    const root = this.document.getRoot();
    const parts = root.getExtension(NAME)?.get('parts');
    if (!parts) return this;
    const isCompressed = root.listExtensionsUsed().some(({ extensionName }) => /compression/.test(extensionName));
    const same = {
      image: (part) => root.listTextures().find((texture) => isSame(texture.getImage() ?? [], part.bytes)),
      accessor: ({ own, accessor, bytes }) =>
        !isCompressed && root.listAccessors().includes(own) && !own.getSparse() && own.getComponentType() === accessor.componentType
          && isSame(bytesOf(own.getArray()), bytes) ? own : undefined,
    };
    this.same = parts.map((part) => (part.image ? same.image(part) : part.accessor ? same.accessor(part) : undefined));
    const lengths = parts.map(({ bytes }, i) => (this.same[i] ? 0 : (bytes.length + 3) & ~3));
    this.offsets = lengths.map((_, i) => lengths.slice(0, i).reduce((sum, length) => sum + length, 0));
    this.block = new Uint8Array(lengths.reduce((sum, length) => sum + length, 0));
    parts.forEach(({ bytes }, i) => this.same[i] ?? this.block.set(bytes, this.offsets[i]));
    const buffer = root.listBuffers()[0] ?? this.document.createBuffer();
    context.otherBufferViews.set(buffer, [...(context.otherBufferViews.get(buffer) ?? []), this.block]);
    return this;
  }

  write(context) {
    const map = this.document.getRoot().getExtension(NAME);
    if (!map) return this;
    const { json } = context.jsonDoc;
    const parts = map.get('parts');
    const whole = json.bufferViews[context.otherBufferViewsIndexMap.get(this.block)];
    const push = (list, thing) => (json[list] ??= []).push(thing) - 1;
    const view = (i) => {
      const byteOffset = whole.byteOffset + this.offsets[i];
      return push('bufferViews', { buffer: whole.buffer, byteOffset, byteLength: parts[i].bytes.length });
    };
    const write = {
      view,
      image: (i) => context.imageIndexMap.get(this.same[i]) ?? push('images', { ...parts[i].image, bufferView: view(i) }),
      accessor: (i) => context.accessorIndexMap.get(this.same[i]) ?? push('accessors', { ...parts[i].accessor, bufferView: view(i) }),
    };
    json.extensions = { ...json.extensions, [NAME]: replaceIndices(map.get('json'), null, (kind, i) => write[kind](i)) };
    return this;
  }
}
