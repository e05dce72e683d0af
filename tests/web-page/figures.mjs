// Sizes, times and memory of pages that show one model, as a table: the viewer by WebGPU and WebGL2, and the full mesh by three.js alone.
//
//     npm ci && node figures.mjs PAGE ASSET.glb VIEWER MODEL.ply
//
// PAGE is the folder that `cargo xtask web --release` makes; VIEWER serves it. The page with the full mesh is that of tools/web/silmap-three,
// whose packages have to be there (`npm ci` in it). Everything is drawn on the display that DISPLAY names, at 640×480, each page as if
// for the first time.
//
// Exit codes: 0 done, 1 something could not be drawn, 2 usage.
import { readFileSync, statSync } from 'node:fs';
import { join } from 'node:path';
import { gzipSync } from 'node:zlib';
import { serve as serveThree } from '../../tools/web/silmap-three/serve.mjs';
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

const heap = (tab) => tab.evaluate(() => performance.memory.usedJSHeapSize);

// What one page takes in a browser that has not seen it: from the address to the first picture, and for each picture of a turn.
async function ofViewer(address, backend) {
  const browser = await launchOnDisplay();
  const tab = await browser.newPage({ viewport: SIZE });
  const since = Date.now();
  await tab.goto(`${address}&bare&backend=${backend}`);
  await until(tab, async () => (await window.silmap).viewer.shown());
  const first = Date.now() - since;
  const [processor, device, whole] = await tab.evaluate(async (count) => {
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
    return [thread, drawn, (performance.now() - began) / count];
  }, PICTURES);
  const memory = await tab.evaluate(async () => (await window.silmap).viewer.memory());
  const found = { first, processor, device, whole, heap: await heap(tab), memory };
  await browser.close();
  return found;
}

async function ofFullMesh(address) {
  const browser = await launchOnDisplay();
  const tab = await browser.newPage({ viewport: SIZE });
  await tab.goto(`${address}/examples/instances.html?renderer=webgl&offscreen=1&count=1&model=/model.ply&what=mesh`);
  await until(tab, () => Boolean(window.silmapBench));
  const bench = await tab.evaluate((count) => window.silmapBench(count), PICTURES);
  await browser.close();
  return { first: bench.times.first, processor: bench.cpu, device: -1, whole: bench.frame, heap: bench.after.heap, memory: 0 };
}

const packed = (file) => gzipSync(readFileSync(file), { level: 9 }).length;
const mebibytes = (bytes) => (bytes / 2 ** 20).toFixed(2);
const millis = (time) => (time < 0 ? '–' : time.toFixed(time < 10 ? 1 : 0));

async function main() {
  const { server, address } = await serveViewer(viewer, page, asset);
  const three = await serveThree({ '/asset.glb': asset, '/model.ply': model });
  try {
    console.log('| page | program, MiB as sent | model, MiB | first picture, ms | a picture, ms | of these the page\'s thread | until drawn | heap, MiB | program\'s memory, MiB |');
    console.log(`|${'---|'.repeat(9)}`);
    const rows = [];
    for (const [backend, name] of [['webgpu', 'viewer, WebGPU'], ['webgl2', 'viewer, WebGL2']]) {
      const files = ['silmap-viewer_bg.wasm', 'silmap-viewer.js'].map((file) => packed(join(page, backend, file)));
      rows.push([name, files[0] + files[1], statSync(asset).size, await ofViewer(address, backend)]);
    }
    const library = join('..', '..', 'tools/web/silmap-three/node_modules/three/build');
    const folder = new URL(`${library}/`, import.meta.url).pathname;
    const scripts = ['three.module.js', 'three.core.js'].map((file) => packed(join(folder, file)));
    rows.push(['full mesh, three.js alone, WebGL2', scripts[0] + scripts[1], packed(model), await ofFullMesh(three.address)]);
    for (const [name, program, bytes, found] of rows) {
      console.log(`| ${name} | ${mebibytes(program)} | ${mebibytes(bytes)} | ${millis(found.first)} | ${millis(found.whole)} | `
        + `${millis(found.processor)} | ${millis(found.device)} | ${mebibytes(found.heap)} | ${mebibytes(found.memory)} |`);
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
