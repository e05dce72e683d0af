// Sizes, times and memory of pages that show one model, as a table: the viewer by WebGPU and WebGL2, the asset clipped by silmap-three, and the
// full mesh by three.js alone.
//
//     npm ci && node figures.mjs PAGE ASSET.glb VIEWER MODEL.ply
//
// PAGE is the folder that `cargo xtask web --release` makes; VIEWER serves it. The pages by three.js are `one-model.html`, with the packages of
// tools/web/silmap-three, which have to be there (`npm ci` and `cargo xtask three --release`). Everything is drawn on the display that
// DISPLAY names, at 640×480, each page as if for the first time.
//
// Exit codes: 0 done, 1 something could not be drawn, 2 usage.
import { readFileSync, statSync } from 'node:fs';
import { join } from 'node:path';
import { gzipSync } from 'node:zlib';
import { fileURLToPath } from 'node:url';
import { PACKAGE, serve as serveThree } from '../../tools/web/silmap-three/serve.mjs';
import { launchOnDisplay, serveViewer, until as untilIn } from './browser.mjs';

const SIZE = { width: 640, height: 480 };
const PICTURES = 30;
const TIMEOUT_MS = 300_000;
const until = (tab, given) => untilIn(tab, given, TIMEOUT_MS);

const [page, asset, viewer, model] = process.argv.slice(2);
if (!model || process.argv.length > 6) {
  console.error('usage: node figures.mjs PAGE ASSET.glb VIEWER MODEL.ply');
  process.exit(2);
}

const packed = (file) => gzipSync(readFileSync(file), { level: 9 }).length;

// What `measure` finds on a page in a browser that has not seen it, and its heap.
async function inBrowser(address, measure) {
  const browser = await launchOnDisplay();
  try {
    const tab = await browser.newPage({ viewport: SIZE });
    tab.on('pageerror', (error) => console.error(error.message));
    const since = Date.now();
    await tab.goto(address);
    const found = await measure(tab, since);
    return { ...found, heap: await tab.evaluate(() => performance.memory.usedJSHeapSize) };
  } finally {
    await browser.close();
  }
}

// The viewer: from the address to the first picture, and for each picture of a turn.
async function ofViewer(address, backend) {
  const program = ['silmap-viewer_bg.wasm', 'silmap-viewer.js'].map((file) => packed(join(page, backend, file)));
  const found = await inBrowser(`${address}&bare&backend=${backend}`, async (tab, since) => {
    await until(tab, async () => (await window.silmap).viewer.shown());
    const first = Date.now() - since;
    const times = await tab.evaluate(async (count) => {
      const { viewer } = await window.silmap;
      const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
      const began = performance.now();
      for (let k = 0; k < count; k++) {
        const angle = (2 * Math.PI * k) / count;
        const [before] = viewer.times();
        viewer.look(`eye=${4 * Math.sin(angle)},1,${4 * Math.cos(angle)}&target=0,0,0`);
        while (viewer.times()[0] === before) await frame();
      }
      const [, thread, drawn] = viewer.times();
      return { thread, drawn, whole: (performance.now() - began) / count };
    }, PICTURES);
    return { first, ...times, memory: await tab.evaluate(async () => (await window.silmap).viewer.memory()) };
  });
  return { ...found, program: program[0] + program[1] };
}

// A model by three.js. The program is what the page asked for of three.js and of the package.
async function ofThree({ address, sent }, query) {
  sent.clear();
  const found = await inBrowser(`${address}/one-model.html?${query}`, async (tab) => {
    await until(tab, () => Boolean(window.measure));
    return tab.evaluate((count) => window.measure(count), PICTURES);
  });
  const scripts = [...sent.keys()].filter((path) => /^\/(node_modules|src|dist)\//.test(path));
  return { ...found, program: scripts.map((path) => packed(join(PACKAGE, path))).reduce((sum, bytes) => sum + bytes, 0) };
}

const mebibytes = (bytes) => (bytes / 2 ** 20).toFixed(2);
const millis = (time) => time.toFixed(time < 10 ? 1 : 0);

async function main() {
  const { server, address } = await serveViewer(viewer, page, asset);
  const here = (name) => fileURLToPath(new URL(name, import.meta.url));
  const three = await serveThree({
    '/asset.glb': asset, '/model.ply': model, '/one-model.html': here('one-model.html'), '/one-model.js': here('one-model.js'),
  });
  const [ofAsset, ofModel] = [statSync(asset).size, packed(model)];
  const rows = [
    ['viewer, WebGPU', ofAsset, () => ofViewer(address, 'webgpu')],
    ['viewer, WebGL2', ofAsset, () => ofViewer(address, 'webgl2')],
    ['clipped, silmap-three, WebGPU', ofAsset, () => ofThree(three, 'asset=/asset.glb&renderer=webgpu')],
    ['clipped, silmap-three, WebGL2', ofAsset, () => ofThree(three, 'asset=/asset.glb')],
    ['full mesh, three.js alone, WebGL2', ofModel, () => ofThree(three, 'model=/model.ply')],
  ];
  const heads = ['page', 'program, MiB as sent', 'model, MiB', 'first picture, ms', 'a picture, ms', 'of these the page\'s thread', 'until drawn', 'heap, MiB',
    'program\'s memory, MiB'];
  try {
    console.log(`| ${heads.join(' | ')} |\n|${'---|'.repeat(heads.length)}`);
    for (const [name, bytes, measure] of rows) {
      const { program, first, whole, thread, drawn, heap, memory } = await measure();
      const cells = [name, mebibytes(program), mebibytes(bytes), ...[first, whole, thread, drawn].map(millis), mebibytes(heap), mebibytes(memory)];
      console.log(`| ${cells.join(' | ')} |`);
    }
  } finally {
    server.kill();
    three.close();
  }
}

main().catch((error) => {
  console.error(error.message);
  process.exitCode = 1;
});
