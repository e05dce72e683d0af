// Types of `silmap-three`.
import type {
  BufferGeometry, InstancedMesh, Material, Mesh, Vector4,
} from 'three';
import type { GLTF, GLTFLoaderPlugin, GLTFParser } from 'three/addons/loaders/GLTFLoader.js';

/** How outlines are made. */
export interface OutlineOptions {
  /**
   * How far an outline may be off, in pixels, where an eye near the one that it was made for uses it too. At zero each eye has its own.
   * Default 0.5.
   */
  reuseErrorPx?: number;
  /** Bytes of the texture that holds outlines. Default 4 MiB. */
  outlineBytes?: number;
  /** Whether a worker makes outlines, where there can be one. Default true. */
  worker?: boolean;
}

/** How an asset is loaded. */
export interface SilmapOptions extends OutlineOptions {
  /** A material with lights and shadows (`MeshStandardMaterial`, with the asset's normals) in place of the file's unlit one. Default false. */
  lit?: boolean;
}

/** The outlines of one asset, which all meshes of it share. */
export class Outlines {
  private constructor();
  /** Reads the bytes of a `.glb`, or of a `.gltf` with those of the buffers that it names. Rejects in one sentence if they are no asset. */
  static read(source: { file: Uint8Array; names?: string[]; files?: Uint8Array[] }, options?: OutlineOptions): Promise<Outlines>;
  /** Middle and radius of the sphere about the model. */
  readonly sphere: Float64Array;
  /** What shaders read; a texture has it on the device. */
  readonly texels: Uint32Array;
  /** Outlines that were made since the asset was read. */
  readonly made: number;
  /** Resolves when no outline is being made: draw, wait, and draw again for a picture with all outlines. */
  settled(): Promise<void>;
  /** Bytes of the worker's memory, of all assets; 0 without a worker. */
  workerMemory(): Promise<number>;
  /** Frees what it holds; meshes of it must not be drawn any more. */
  dispose(): void;
}

/** What meshes of assets have in common. */
interface Clipped {
  readonly outlines: Outlines;
  /** The material as it was given. */
  readonly plainMaterial: Material;
  /** Draws with another material, of which the mesh keeps a copy that is clipped. */
  setMaterial(material: Material): void;
}

/** A hull that is drawn inside of the outline that the camera at hand sees; in shadows that of the light. */
export class SilmapMesh extends Mesh implements Clipped {
  constructor(geometry: BufferGeometry, material: Material, outlines: Outlines, fromMesh?: Vector4);
  readonly isSilmapMesh: true;
  readonly outlines: Outlines;
  readonly plainMaterial: Material;
  setMaterial(material: Material): void;
  dispose(): void;
}

/** Many instances of a hull in one draw call, each inside of its own outline. */
export class SilmapInstancedMesh extends InstancedMesh implements Clipped {
  constructor(mesh: SilmapMesh, count: number);
  readonly isSilmapInstancedMesh: true;
  readonly outlines: Outlines;
  readonly plainMaterial: Material;
  setMaterial(material: Material): void;
  dispose(): this;
}

/** The plugin: `new GLTFLoader().register((parser) => new SilmapExtension(parser))`. */
export class SilmapExtension implements GLTFLoaderPlugin {
  constructor(parser: GLTFParser, options?: SilmapOptions);
  readonly name: 'SILMAP_silhouette_map';
  /** Replaces the asset's meshes, and puts its outlines into `userData.silmap`. */
  afterRoot(result: GLTF): Promise<void>;
}
