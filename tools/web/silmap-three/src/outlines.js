// The outlines of one asset: which there are, the texture that holds them, and the worker that makes new ones.
import { DataArrayTexture, DataTexture, RGBAIntegerFormat, UnsignedIntType } from 'three';
import init, { OutlineCells, OutlineMaker } from '../dist/silmap_outlines.js';
import { ROW } from './clip-glsl.js';

/** Numbers of an eye (its place with a 1, or the direction to it with a 0, and the sphere's radius in pixels) and of a record. */
export const EYE = 5;
export const RECORD = 8;
const REQUEST = 6;

/** Outlines that are being made at a time, and made at once without a worker for eyes that have one that serves for now. */
const MOST_PENDING = 96;
const MOST_AT_ONCE = 8;

/** Layers that a texture may have on every device. */
const MOST_LAYERS = 256;
const LEAST_ROWS = 16;

let compiled;
let workshop;

/** Compiles the module once for this thread and the worker. */
function compile() {
  compiled ??= (async () => {
    const url = new URL('../dist/silmap_outlines_bg.wasm', import.meta.url);
    const answer = await fetch(url);
    if (!answer.ok) throw new Error(`${url.href}: ${answer.status} ${answer.statusText}`);
    const module = await WebAssembly.compile(await answer.arrayBuffer());
    const wasm = await init({ module_or_path: module });
    return { module, memory: wasm.memory };
  })();
  return compiled;
}

/** The worker of all assets; none where the page may have none. */
class Workshop {
  #worker;
  #waiting = new Map();
  #listeners = new Map();
  #next = 0;

  static async open(module) {
    const worker = new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
    const self = new Workshop();
    self.#worker = worker;
    worker.onmessage = ({ data }) => self.#receive(data);
    await new Promise((resolve, reject) => {
      worker.onerror = (event) => reject(new Error(event.message ?? 'the worker does not start'));
      self.#waiting.set(0, { resolve, reject });
      self.#next = 1;
      worker.postMessage({ kind: 'start', ask: 0, module });
    });
    return self;
  }

  #receive({ ask, error, asset, made, ...answer }) {
    if (made) {
      this.#listeners.get(asset)?.(made);
      return;
    }
    const waiting = this.#waiting.get(ask);
    this.#waiting.delete(ask);
    if (error) waiting?.reject(new Error(error));
    else waiting?.resolve(answer);
  }

  /** Reads an asset; answers its sphere. */
  async read(what, listener) {
    const asset = this.#next++;
    this.#listeners.set(asset, listener);
    try {
      const answer = await new Promise((resolve, reject) => {
        this.#waiting.set(asset, { resolve, reject });
        this.#worker.postMessage({ kind: 'read', ask: asset, ...what }, what.files.concat(what.file).map(({ buffer }) => buffer));
      });
      return { asset, ...answer };
    } catch (error) {
      this.#listeners.delete(asset);
      throw error;
    }
  }

  make(asset, requests) {
    this.#worker.postMessage({ kind: 'make', asset, requests }, [requests.buffer]);
  }

  forget(asset) {
    this.#listeners.delete(asset);
    this.#worker.postMessage({ kind: 'forget', asset });
  }

  memory() {
    const ask = this.#next++;
    return new Promise((resolve, reject) => {
      this.#waiting.set(ask, { resolve, reject });
      this.#worker.postMessage({ kind: 'memory', ask });
    });
  }
}

function openWorkshop(module) {
  workshop ??= typeof Worker === 'undefined' ? Promise.resolve(null) : Workshop.open(module).catch(() => null);
  return workshop;
}

/** The outlines of one asset. */
export class Outlines {
  /**
   * Reads an asset: the bytes of a `.glb`, or of a `.gltf` with those of the files that it names.
   * @returns {Promise<Outlines>}
   */
  static async read({ file, names = [], files = [] }, { reuseErrorPx = 0.5, outlineBytes = 4 << 20, worker = true } = {}) {
    const { module, memory } = await compile();
    const self = new Outlines();
    self.memory = memory;
    const shop = worker ? await openWorkshop(module) : null;
    if (shop) {
      const what = { file, names, files, allowedPx: reuseErrorPx };
      const { asset, sphere } = await shop.read(what, (made) => self.#take(made));
      self.sphere = sphere;
      self.make = (requests) => shop.make(asset, requests);
      self.close = () => shop.forget(asset);
      self.workerMemory = async () => (await shop.memory()).bytes;
    } else {
      const maker = new OutlineMaker(file, names, files, reuseErrorPx);
      self.sphere = maker.sphere();
      self.maker = maker;
      self.close = () => maker.free();
      self.workerMemory = async () => 0;
    }
    const rows = Math.max(LEAST_ROWS, Math.ceil(outlineBytes / (16 * ROW)));
    self.layerRows = 2 ** Math.max(0, Math.ceil(Math.log2(rows / MOST_LAYERS)));
    self.layers = Math.ceil(rows / self.layerRows);
    const texels = self.layers * self.layerRows * ROW;
    self.cells = new OutlineCells(self.sphere, reuseErrorPx, texels);
    self.texels = new Uint32Array(4 * texels);
    return self;
  }

  #device = null;
  #texture = null;
  #isSent = false;

  /**
   * The texture that a renderer reads. WebGLRenderer sends what changed of any; WebGPURenderer sends no less than a layer. Renderers that take
   * turns are sent the whole each time, and so is one whose context was lost.
   */
  textureFor(renderer) {
    const device = renderer.properties ?? renderer;
    if (this.#device !== device) {
      this.#texture?.dispose();
      const { texels, layers, layerRows } = this;
      const texture = renderer.isWebGLRenderer
        ? new DataTexture(texels, ROW, layers * layerRows) : new DataArrayTexture(texels, ROW, layerRows, layers);
      const onUpdate = () => {
        this.#isSent = true;
      };
      Object.assign(texture, { format: RGBAIntegerFormat, type: UnsignedIntType, needsUpdate: true, onUpdate });
      [this.#device, this.#texture, this.#isSent] = [device, texture, false];
    }
    return this.#texture;
  }

  #isPlanned = false;
  #settling = [];
  #isClosed = false;
  /** Outlines that were made since the asset was read. */
  made = 0;

  /**
   * Finds the outlines of eyes (`EYE` numbers each) and writes `RECORD` numbers each; `before` has one number an eye, which is kept from
   * call to call. What is missing comes later, where there is a worker, and then serves the next picture.
   */
  find(eyes, before, records) {
    if (this.#isClosed) return;
    const missing = this.cells.find(eyes, before, records);
    if (this.maker) {
      this.#makeHere(this.cells.take_wanted(missing > 0 ? 0xffffffff : MOST_AT_ONCE));
      if (missing > 0) this.cells.find(eyes, before, records);
    }
    if (!this.#isPlanned) {
      this.#isPlanned = true;
      queueMicrotask(() => this.#afterFrame());
    }
  }

  #makeHere(requests) {
    for (let at = 0; at < requests.length; at += REQUEST) {
      this.#keep(requests[at + REQUEST - 1], this.maker.make(requests.subarray(at, at + REQUEST - 1)));
    }
  }

  /** After all that a frame asks for: passes on what is missing. */
  #afterFrame() {
    this.#isPlanned = false;
    if (this.#isClosed) return;
    if (!this.maker) {
      const requests = this.cells.take_wanted(Math.max(0, MOST_PENDING - this.cells.pending()));
      if (requests.length > 0) this.make(requests);
    }
    this.cells.begin_frame();
    this.#settle();
  }

  #take(made) {
    if (this.#isClosed) return;
    for (const { name, texels } of made) this.#keep(name, texels);
    this.#settle();
  }

  #keep(name, texels) {
    this.made += 1;
    const count = texels.length / 4;
    const start = this.cells.keep(name, count, count > 0 ? texels[0] : 0);
    if (start < 0) {
      this.#warnOnce();
      return;
    }
    this.texels.set(texels, 4 * start);
    const texture = this.#texture;
    // Before the whole was sent nothing is a change. A range must not go on in the next row.
    for (let at = start; this.#isSent && at < start + count;) {
      const row = Math.floor(at / ROW);
      const end = Math.min(start + count, (row + 1) * ROW);
      if (texture.isDataArrayTexture) texture.addLayerUpdate(Math.floor(row / this.layerRows));
      else texture.addUpdateRange(4 * at, 4 * (end - at));
      at = end;
    }
    if (texture) texture.needsUpdate = true;
  }

  #warnOnce() {
    if (this.hasWarned) return;
    this.hasWarned = true;
    console.warn('silmap-three: all outlines in use do not fit in the texture, so that some hulls show unclipped: raise outlineBytes');
  }

  /** Resolves when no outline is being made. Draw, wait, and draw again for a picture with all outlines. */
  settled() {
    return new Promise((resolve) => {
      this.#settling.push(resolve);
      queueMicrotask(() => this.#settle());
    });
  }

  #settle() {
    if (this.#isPlanned || this.cells.pending() > 0) return;
    for (const resolve of this.#settling.splice(0)) resolve();
  }

  dispose() {
    if (this.#isClosed) return;
    this.#isClosed = true;
    this.close();
    this.cells.free();
    this.#texture?.dispose();
    for (const resolve of this.#settling.splice(0)) resolve();
  }
}
