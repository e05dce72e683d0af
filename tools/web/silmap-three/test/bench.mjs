// Times, sizes and memory of instances that roam in a headless browser, as the tables of README: clipped hulls, plain hulls, and full meshes by
// three.js alone.
//
//     npm ci && node test/bench.mjs ASSET.glb MODEL.ply [--count 500] [--few 20] [--frames 30] [--seconds 120] [--size 640x400]
//         [--rows webgl:clipped,webgl:plain,webgl:mesh,webgpu:clipped] [--memory FRAMES]
//
// A row is drawn with both numbers of instances, for FRAMES pictures each or for SECONDS. With --memory nothing is timed: so many pictures of
// roaming hulls must leave memory as it is after a fifth of them. Exit codes: 0 done, 1 memory grows (or nothing could be drawn), 2 usage.
import { readFileSync, statSync } from 'node:fs';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { gzipSync } from 'node:zlib';
import { PACKAGE, serve } from '../serve.mjs';
import { openBrowser } from './browser.mjs';

// Bytes by which memory may grow, whatever was drawn in between: what garbage collection leaves. The worker keeps what it has prepared of
// the map, up to a bound: that of the bunny ends at 121 MB.
const GROWTH_AT_MOST = { heap: 2 << 20, wasm: 1 << 20, worker: 16 << 20, outlines: 0, geometries: 0, textures: 0 };
const TIMEOUT_MS = 600_000;
const KINDS = { clipped: 'clipped hulls', plain: 'plain hulls', mesh: 'full meshes by three.js alone' };
const RENDERERS = { webgl: '`WebGLRenderer`', webgpu: '`WebGPURenderer`' };

const value = (preset) => ({ type: 'string', default: preset });
const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    count: value('500'), few: value('20'), frames: value('30'), seconds: value('120'), size: value('640x400'),
    rows: value('webgl:clipped,webgl:plain,webgl:mesh,webgpu:clipped'), memory: { type: 'string' },
  },
});
const [asset, model] = positionals;
const rows = values.rows.split(',').map((row) => row.split(':'));
if (positionals.length !== 2 || rows.some(([renderer, kind]) => !(renderer in RENDERERS && kind in KINDS))) {
  console.error('usage: node test/bench.mjs ASSET.glb MODEL.ply [--count N] [--few N] [--frames N] [--seconds N] [--size WxH]\n'
    + '           [--rows webgl:clipped,webgpu:mesh,...] [--memory FRAMES]');
  process.exit(2);
}
const [width, height] = values.size.split('x').map(Number);
const megabytes = (bytes) => (bytes / 1e6).toFixed(1);
const duration = (millis) => (millis < 100 ? `${millis.toFixed(millis < 10 ? 1 : 0)} ms` : `${(millis / 1000).toFixed(millis < 1000 ? 2 : 1)} s`);
const thousands = (number) => number.toLocaleString('en');

/** What `run` finds on a page with so many instances, and what the page was sent. */
async function onPage({ browser, server }, renderer, kind, count, run) {
  const tab = await browser.newPage({ viewport: { width, height } });
  tab.setDefaultTimeout(TIMEOUT_MS);
  tab.on('pageerror', (error) => console.error(error.message));
  // A page that has no use for a file is not told of it.
  const files = { clipped: '&asset=/asset.glb', plain: '&asset=/asset.glb&what=plain', mesh: '&model=/model.ply&what=mesh' };
  await tab.goto(`${server.address}/examples/instances.html?renderer=${renderer}&offscreen=1&count=${count}${files[kind]}`);
  await tab.waitForFunction(() => window.silmapBench);
  const found = await run((frames, millis) => tab.evaluate(([n, most]) => window.silmapBench(n, most), [frames, millis]));
  await tab.close();
  return found;
}

async function printTimes(place) {
  const { count, few } = values;
  const heads = [`${count} instances`, 'first picture with all outlines', 'a picture', 'of these the page\'s thread', `a picture of ${few}`, 'JavaScript heap',
    'module, page and worker'];
  console.log(`| ${heads.join(' | ')} |\n|${'---|'.repeat(heads.length)}`);
  for (const [renderer, kind] of rows) {
    const timed = (n) => onPage(place, renderer, kind, n, (bench) => bench(Number(values.frames), 1000 * Number(values.seconds)));
    const [many, some] = [await timed(count), await timed(few)];
    const { after, times } = many;
    const cells = [`${KINDS[kind]}, ${RENDERERS[renderer]}`, duration(times.clipped ?? times.first), duration(many.frame), duration(many.cpu),
      duration(some.frame), `${megabytes(after.heap)} MB`,
      kind === 'clipped' ? `${megabytes(after.wasm + after.worker)} MB` : ''];
    console.log(`| ${cells.join(' | ')} |`);
  }
}

function printSizes() {
  console.log('\n| bytes | file | by gzip |\n|---|---|---|');
  const files = { 'asset, with what this package does not draw': asset, 'full mesh': model, module: join(PACKAGE, 'dist/silmap_outlines_bg.wasm') };
  for (const [name, path] of Object.entries(files)) {
    console.log(`| ${name} | ${thousands(statSync(path).size)} | ${thousands(gzipSync(readFileSync(path), { level: 9 }).length)} |`);
  }
}

async function printMemory(place) {
  const most = Number(values.memory);
  const early = Math.ceil(most / 5);
  console.log(`| ${values.count} instances, after ${early} and ${most} pictures | heap | page's module | worker's module | geometries | textures |\n|${'---|'.repeat(6)}`);
  const faults = [];
  for (const renderer of new Set(rows.map(([name]) => name))) {
    const [first, last] = await onPage(place, renderer, 'clipped', values.count, async (bench) => [await bench(early), await bench(most - early)]);
    const [a, b] = [first.after, last.after];
    const both = (what, show) => `${show(a[what])}, ${show(b[what])}`;
    const cells = [...['heap', 'wasm', 'worker'].map((what) => both(what, (bytes) => `${megabytes(bytes)} MB`)), both('geometries', String), both('textures', String)];
    console.log(`| ${RENDERERS[renderer]} | ${cells.join(' | ')} |`);
    faults.push(...Object.keys(GROWTH_AT_MOST).filter((what) => b[what] - a[what] > GROWTH_AT_MOST[what]).map((what) => `${what} grows`));
    if (!(last.made > 0)) faults.push('nothing roamed');
  }
  if (faults.length > 0) throw new Error(faults.join(', '));
}

async function main() {
  const server = await serve({ '/asset.glb': asset, '/model.ply': model });
  const browser = await openBrowser();
  try {
    if (values.memory) {
      await printMemory({ browser, server });
    } else {
      await printTimes({ browser, server });
      printSizes();
    }
  } finally {
    await browser.close();
    server.close();
  }
}

main().catch((error) => {
  console.error(error.message);
  process.exitCode = 1;
});
