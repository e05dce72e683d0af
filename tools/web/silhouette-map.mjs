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

  /** Puts the bytes of all parts into the first buffer. */
  prewrite(context) {
    const map = this.document.getRoot().getExtension(NAME);
    if (!map) return this;
    let length = 0;
    const offsets = map.get('parts').map(({ bytes }) => (length += (bytes.length + 3) & ~3) - ((bytes.length + 3) & ~3));
    const block = new Uint8Array(length);
    map.get('parts').forEach(({ bytes }, i) => block.set(bytes, offsets[i]));
    const buffer = this.document.getRoot().listBuffers()[0] ?? this.document.createBuffer();
    context.otherBufferViews.set(buffer, [...(context.otherBufferViews.get(buffer) ?? []), block]);
    Object.assign(this, { block, offsets });
    return this;
  }

  write(context) {
    const map = this.document.getRoot().getExtension(NAME);
    if (!map) return this;
    const { json } = context.jsonDoc;
    const whole = json.bufferViews[context.otherBufferViewsIndexMap.get(this.block)];
    const push = (list, thing) => (json[list] ??= []).push(thing) - 1;
    const view = (i) => {
      const byteOffset = whole.byteOffset + this.offsets[i];
      return push('bufferViews', { buffer: whole.buffer, byteOffset, byteLength: map.get('parts')[i].bytes.length });
    };
    const write = {
      view: (part, i) => view(i),
      // A texture that is still the same picture is not stored twice.
      image: (part, i) => {
        const same = [...context.imageIndexMap].find(([texture]) => isSame(texture.getImage() ?? [], part.bytes));
        return same ? same[1] : push('images', { ...part.image, bufferView: view(i) });
      },
      accessor: ({ own, accessor, bytes }, i) => {
        const index = own.isDisposed() ? undefined : context.accessorIndexMap.get(own);
        const isPlain = own.getComponentType() === accessor.componentType && !json.accessors[index]?.sparse;
        if (index !== undefined && isPlain && isSame(bytesOf(own.getArray()), bytes)) return index;
        return push('accessors', { ...accessor, bufferView: view(i) });
      },
    };
    const made = replaceIndices(map.get('json'), null, (kind, i) => write[kind](map.get('parts')[i], i));
    json.extensions = { ...json.extensions, [NAME]: made };
    return this;
  }
}
