// Times, sizes and memory of 500 instances in a headless browser, as a table: clipped hulls, plain hulls, and full meshes by three.js alone.
//
//     npm ci && node test/bench.mjs ASSET.glb MODEL.ply [--frames N] [--memory FRAMES] [--size WxH] [--count N]
//         [--renderer webgl|webgpu] [--kinds clipped,plain,mesh]
//
// With --memory nothing is timed: so many frames of roaming hulls must leave memory as it is after a fifth of them. Exit codes: 0 done, 1
// memory grows (or nothing could be drawn), 2 usage.
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
const KINDS = { clipped: 'clipped hulls', plain: 'plain hulls', mesh: 'full meshes, three.js alone' };

const text = { type: 'string' };
const { values, positionals } = parseArgs({ allowPositionals: true, options: { frames: text, memory: text, size: text, count: text, renderer: text, kinds: text } });
const [asset, model] = positionals;
if (positionals.length !== 2) {
  console.error('usage: node test/bench.mjs ASSET.glb MODEL.ply [--frames N] [--memory FRAMES] [--size WxH] [--count N] [--renderer webgl|webgpu]');
  process.exit(2);
}
const [width, height] = (values.size ?? '640x400').split('x').map(Number);
const count = values.count ?? '500';
const frames = Number(values.frames ?? 30);
const renderers = values.renderer ? [values.renderer] : ['webgl', 'webgpu'];
const megabytes = (bytes) => (bytes / 1e6).toFixed(1);

async function measure(browser, { address, sent }, renderer, kind, run) {
  sent.clear();
  const tab = await browser.newPage({ viewport: { width, height } });
  tab.setDefaultTimeout(TIMEOUT_MS);
  tab.on('pageerror', (error) => console.error(error.message));
  // A page that has no use for a file is not told of it.
  const files = { clipped: '&asset=/asset.glb', plain: '&asset=/asset.glb&what=plain', mesh: '&model=/model.ply&what=mesh' };
  await tab.goto(`${address}/examples/instances.html?renderer=${renderer}&offscreen=1&count=${count}${files[kind]}`);
  await tab.waitForFunction(() => window.silmapBench, null, { timeout: TIMEOUT_MS });
  const found = await run(tab);
  await tab.close();
  return { ...found, sent: new Map(sent) };
}

async function main() {
  const server = await serve({ '/asset.glb': asset, '/model.ply': model });
  const browser = await openBrowser();
  try {
    if (values.memory) {
      const most = Number(values.memory);
      for (const renderer of renderers) {
        const { first, last } = await measure(browser, server, renderer, 'clipped', async (tab) => {
          const bench = (n) => tab.evaluate((k) => window.silmapBench(k), n);
          const early = await bench(Math.ceil(most / 5));
          const late = await bench(most - Math.ceil(most / 5));
          return { first: early, last: late };
        });
        const [a, b] = [first.after, last.after];
        console.log(`${renderer}: after ${first.frames} frames, and after ${last.frames} more with ${last.made} new outlines`);
        for (const what of Object.keys(a)) console.log(`  ${what}: ${a[what]}, ${b[what]}`);
        const grows = Object.keys(GROWTH_AT_MOST).filter((what) => b[what] - a[what] > GROWTH_AT_MOST[what]);
        if (grows.length > 0) throw new Error(`memory grows: ${grows.join(', ')}`);
        if (!(last.made > 0)) throw new Error('nothing roamed');
      }
      return;
    }
    console.log(`| renderer | shows | first picture, ms | picture, ms | of these the page's thread, ms | heap, MB | wasm, MB | outlines, MB |\n|${'---|'.repeat(8)}`);
    for (const renderer of renderers) {
      for (const kind of values.kinds?.split(',') ?? Object.keys(KINDS)) {
        const found = await measure(browser, server, renderer, kind, (tab) => tab.evaluate((n) => window.silmapBench(n), frames));
        const { after, times } = found;
        console.log(`| ${renderer} | ${KINDS[kind]} | ${Math.round(times.clipped ?? times.first)} | ${Math.round(found.frame)} | ${found.cpu.toFixed(1)} | `
          + `${megabytes(after.heap)} | ${megabytes(after.wasm + after.worker)} | ${megabytes(after.outlines)} |`);
      }
    }
    const sizes = [['asset', asset], ['full mesh', model], ['module', join(PACKAGE, 'dist/silmap_outlines_bg.wasm')]];
    for (const [name, path] of sizes) console.log(`${name}: ${statSync(path).size} bytes, ${gzipSync(readFileSync(path), { level: 9 }).length} by gzip`);
  } finally {
    await browser.close();
    server.close();
  }
}

main().catch((error) => {
  console.error(error.message);
  process.exitCode = 1;
});
