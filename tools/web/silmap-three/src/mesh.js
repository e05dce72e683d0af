// What the scene holds: a mesh, or many instances of one, each clipped to the outline that the camera at hand sees.
import {
  BufferGeometry, CustomBlending, DataTexture, FloatType, Frustum, InstancedMesh, Matrix4, Mesh, MeshDepthMaterial, MeshDistanceMaterial, NearestFilter,
  NormalBlending, Object3D, OneFactor, RGBAFormat, Sphere, Vector2, Vector3, Vector4, ZeroFactor,
} from 'three';
import { ROW, clipByGlsl } from './clip-glsl.js';
import { EYE, RECORD } from './outlines.js';

const objectFromMap = new Matrix4();
const mapFromWorld = new Matrix4();
const clipFromWorld = new Matrix4();
const instance = new Matrix4();
const place = new Vector3();
const middle = new Vector3();
const size = new Vector2();
const frustum = new Frustum();
const sphere = new Sphere();

/** A geometry of the same arrays, without tangents: WebGPURenderer does not turn these as it does an instance. */
function withoutTangents(geometry) {
  const copy = new BufferGeometry().setIndex(geometry.index);
  for (const [name, attribute] of Object.entries(geometry.attributes)) {
    if (name !== 'tangent') copy.setAttribute(name, attribute);
  }
  copy.boundingSphere = geometry.boundingSphere;
  return copy;
}

/** Adds the nodes by which WebGPURenderer clips; `silmap-three/webgpu` sets it. */
let addNodes = null;
export function setNodes(add) {
  addNodes = add;
}

/** Where a camera is, in the coordinates of a map that `worldFromMap` puts into the world, and how large the map's sphere is. */
function writeEye(eyes, at, camera, worldFromMap, [x, y, z, radius], heightPx) {
  mapFromWorld.copy(worldFromMap).invert();
  const worldRadius = radius * worldFromMap.getMaxScaleOnAxis();
  const half = 0.5 * heightPx * Math.abs(camera.projectionMatrix.elements[5]);
  let radiusPx;
  if (camera.isOrthographicCamera) {
    // Towards the viewer.
    place.setFromMatrixColumn(camera.matrixWorld, 2).transformDirection(mapFromWorld);
    radiusPx = half * worldRadius;
  } else {
    place.setFromMatrixPosition(camera.matrixWorld);
    const outside = middle.set(x, y, z).applyMatrix4(worldFromMap).distanceToSquared(place) - worldRadius ** 2;
    radiusPx = (half * worldRadius) / Math.sqrt(Math.max(outside, 1e-12 * worldRadius ** 2));
    place.applyMatrix4(mapFromWorld);
  }
  eyes[at] = place.x;
  eyes[at + 1] = place.y;
  eyes[at + 2] = place.z;
  eyes[at + 3] = camera.isOrthographicCamera ? 0 : 1;
  eyes[at + 4] = radiusPx;
}

function heightOf(renderer) {
  const target = renderer.getRenderTarget();
  return target ? target.height : renderer.getDrawingBufferSize(size).y;
}

function samplesOf(renderer) {
  const target = renderer.getRenderTarget();
  if (target) return target.samples;
  // WebGPURenderer says itself; it draws into a target of its own.
  if (renderer.isWebGLRenderer) return renderer.getContext().getContextAttributes()?.antialias ? 4 : 0;
  return renderer.samples ?? 0;
}

/** What both kinds of mesh share. */
const Clipped = (Base) => class extends Base {
  #before = new WeakMap();

  /** Takes an asset's outlines; `fromMesh` is what moves and scales vertices to the map's coordinates. */
  initialise(outlines, material, fromMesh) {
    this.outlines = outlines;
    this.fromMesh = fromMesh;
    const [x, y, z, radius] = outlines.sphere;
    const uniforms = {
      // A renderer has a texture of its own.
      silmapTexels: { value: null },
      silmapLayerBits: { value: Math.log2(outlines.layerRows) },
      silmapSphere: { value: new Vector4(x, y, z, radius) },
      silmapFromMesh: { value: fromMesh },
      silmapSoft: { value: 0 },
    };
    if (this.isInstancedMesh) {
      uniforms.silmapRecords = { value: null };
    } else {
      uniforms.silmapEye = { value: new Vector4() };
      uniforms.silmapOutline = { value: new Vector2() };
    }
    this.clipUniforms = uniforms;
    this.customDepthMaterial = clipByGlsl(new MeshDepthMaterial(), uniforms);
    this.customDistanceMaterial = clipByGlsl(new MeshDistanceMaterial(), uniforms);
    this.setMaterial(material);
    // WebGPURenderer may draw shadows between this and the mesh; its nodes ask by `updateOnce`.
    this.onBeforeRender = (renderer, _scene, camera) => renderer.isWebGLRenderer && this.updateOutlines(renderer, camera, samplesOf(renderer) > 1);
    this.onBeforeShadow = (renderer, _object, _camera, shadowCamera) => renderer.isWebGLRenderer && this.updateOutlines(renderer, shadowCamera, false);
  }

  #updatedFor = { renderer: null, camera: null, renderId: -1 };

  /** Brings what shaders read up to date, once in a pass. */
  updateOnce(renderer, camera, renderId) {
    const last = this.#updatedFor;
    if (last.renderer === renderer && last.camera === camera && last.renderId === renderId) return;
    this.#updatedFor = { renderer, camera, renderId };
    this.updateOutlines(renderer, camera, samplesOf(renderer) > 1);
  }

  /** Draws with another material, of which the mesh keeps a copy that is clipped. */
  setMaterial(material) {
    this.clippedMaterial?.dispose();
    this.plainMaterial = material;
    const clipped = material.clone();
    clipped.onBeforeCompile = material.onBeforeCompile;
    clipped.customProgramCacheKey = material.customProgramCacheKey;
    // Without samples it does nothing.
    clipped.alphaToCoverage = true;
    if (!clipped.transparent && clipped.blending === NormalBlending) {
      // Alpha is for coverage alone: what is behind the picture must not show through its edges.
      Object.assign(clipped, { blending: CustomBlending, blendSrc: OneFactor, blendDst: ZeroFactor, blendSrcAlpha: OneFactor, blendDstAlpha: OneFactor });
    }
    clipByGlsl(clipped, this.clipUniforms);
    addNodes?.(clipped, this.isInstancedMesh === true);
    this.clippedMaterial = clipped;
    this.material = clipped;
  }

  worldFromMap(target) {
    const { x, y, z, w } = this.fromMesh;
    const back = 1 / w;
    objectFromMap.makeScale(back, back, back).setPosition(-x * back, -y * back, -z * back);
    return target.multiplyMatrices(this.matrixWorld, objectFromMap);
  }

  /** Of each eye the outline that it used last, by the camera. */
  before(camera, count) {
    let before = this.#before.get(camera);
    if (before?.length !== count) {
      before = new BigUint64Array(count);
      this.#before.set(camera, before);
    }
    return before;
  }

  /** JSON has no outlines: it gives the plain hull back. */
  toJSON(meta) {
    const { material } = this;
    if (material === this.clippedMaterial) this.material = this.plainMaterial;
    try {
      return super.toJSON(meta);
    } finally {
      this.material = material;
    }
  }

  dispose() {
    super.dispose?.();
    this.clippedMaterial.dispose();
    this.customDepthMaterial.dispose();
    this.customDistanceMaterial.dispose();
  }
};

/** A hull that is drawn inside of its outline. */
export class SilmapMesh extends Clipped(Mesh) {
  #eye = new Float64Array(EYE);
  #record = new Float32Array(RECORD);
  #matrix = new Matrix4();

  constructor(geometry, material, outlines, fromMesh = new Vector4(0, 0, 0, 1)) {
    super(geometry, material);
    this.isSilmapMesh = true;
    if (outlines) this.initialise(outlines, material, fromMesh);
  }

  copy(source, recursive) {
    super.copy(source, recursive);
    this.initialise(source.outlines, source.plainMaterial, source.fromMesh);
    return this;
  }

  updateOutlines(renderer, camera, isSoft) {
    const { outlines, clipUniforms } = this;
    clipUniforms.silmapTexels.value = outlines.textureFor(renderer);
    writeEye(this.#eye, 0, camera, this.worldFromMap(this.#matrix), outlines.sphere, heightOf(renderer));
    outlines.find(this.#eye, this.before(camera, 1), this.#record);
    clipUniforms.silmapEye.value.fromArray(this.#record);
    clipUniforms.silmapOutline.value.fromArray(this.#record, 4);
    clipUniforms.silmapSoft.value = isSoft ? 1 : 0;
  }
}

/** Many instances of a hull, each inside of its own outline. */
export class SilmapInstancedMesh extends Clipped(InstancedMesh) {
  #eyes;
  #records = new WeakMap();
  #textures = new Set();
  #matrix = new Matrix4();
  #world = new Matrix4();

  /** Of a mesh that was loaded, or of another such; outlines are shared. */
  constructor(mesh, count) {
    super(addNodes ? withoutTangents(mesh.geometry) : mesh.geometry, mesh.plainMaterial, count);
    this.isSilmapInstancedMesh = true;
    this.#eyes = new Float64Array(EYE * count);
    this.initialise(mesh.outlines, mesh.plainMaterial, mesh.fromMesh);
    // Instances roam; those out of the picture get no outlines.
    this.frustumCulled = false;
    this.castShadow = mesh.castShadow;
    this.receiveShadow = mesh.receiveShadow;
  }

  /** What shaders read of each instance: of each camera its own, as WebGPU draws nothing before all is written. */
  #recordsOf(camera) {
    let records = this.#records.get(camera);
    if (!records) {
      const rows = Math.ceil((this.instanceMatrix.count * RECORD) / (4 * ROW));
      records = new DataTexture(new Float32Array(4 * ROW * rows), ROW, rows, RGBAFormat, FloatType);
      records.minFilter = records.magFilter = NearestFilter;
      this.#records.set(camera, records);
      this.#textures.add(records);
    }
    return records;
  }

  updateOutlines(renderer, camera, isSoft) {
    const { outlines, count, geometry } = this;
    const records = this.#recordsOf(camera);
    this.clipUniforms.silmapRecords.value = records;
    this.clipUniforms.silmapTexels.value = outlines.textureFor(renderer);
    const eyes = this.#eyes;
    const heightPx = heightOf(renderer);
    if (geometry.boundingSphere === null) geometry.computeBoundingSphere();
    clipFromWorld.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
    frustum.setFromProjectionMatrix(clipFromWorld, camera.coordinateSystem, camera.reversedDepth);
    this.worldFromMap(this.#matrix);
    for (let k = 0; k < count; k++) {
      this.getMatrixAt(k, instance);
      this.#world.multiplyMatrices(this.matrixWorld, instance);
      sphere.copy(geometry.boundingSphere).applyMatrix4(this.#world);
      if (frustum.intersectsSphere(sphere)) {
        this.#world.multiply(objectFromMap);
        writeEye(eyes, EYE * k, camera, this.#world, outlines.sphere, heightPx);
      } else {
        // No eye wants no outline.
        eyes[EYE * k] = NaN;
      }
    }
    outlines.find(eyes.subarray(0, EYE * count), this.before(camera, count), records.image.data);
    records.needsUpdate = true;
    this.clipUniforms.silmapSoft.value = isSoft ? 1 : 0;
  }

  clone(recursive) {
    const { instanceMatrix, instanceColor, count } = this;
    const copy = new SilmapInstancedMesh(this, instanceMatrix.count);
    Object3D.prototype.copy.call(copy, this, recursive);
    copy.instanceMatrix.copy(instanceMatrix);
    copy.instanceColor = instanceColor?.clone() ?? null;
    copy.count = count;
    return copy;
  }

  dispose() {
    super.dispose();
    for (const texture of this.#textures) texture.dispose();
    return this;
  }
}
