// Tries the viewer's page, and the two example pages for three.js, in the browsers that are here, and prints the rows of the table in
// docs/viewer.md: what draws, and how many pixels differ from Chromium's picture, the viewer's by WebGL2. On a display that need not be seen.
//
//     npm ci && node browsers.mjs PAGE ASSET.glb VIEWER [PICTURES [BROWSER...]]
//
// PAGE is the folder that `cargo xtask web --release` makes, VIEWER serves it. The pages for three.js are tried where
// `cargo xtask three --release` and `npm ci` have been run in tools/web/silmap-three. Pictures are left in PICTURES, to be looked at.
// Without a BROWSER all that are here are tried.
//
// Exit codes: 0 what a browser here can draw by is drawn right, 1 it is not, 2 usage.
import { existsSync, mkdirSync, mkdtempSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { PNG } from 'pngjs';
import { compare, serveViewer } from './browser.mjs';
import { browsers } from './other_browsers.mjs';

const SIZE = 400;
const VIEW = { eye: '1.5,1,3', target: '0,0,0', fov: '40', bare: '' };
// Samples of a pixel lie elsewhere, and thin slivers fall between them: of the pixels at edges so many may differ.
const LIMITS = { steps: 10, offAtMost: 0.02 };
const TIMEOUT_MS = 90_000;
// An empty picture has one or two, a drawn one thousands.
const LEAST_COLOURS = 200;
const THREE = new URL('../../tools/web/silmap-three/', import.meta.url).pathname;

const [page, asset, viewer, kept, ...asked] = process.argv.slice(2);
if (!viewer) {
  console.error('usage: node browsers.mjs PAGE ASSET.glb VIEWER [PICTURES [BROWSER...]]');
  process.exit(2);
}
const folder = kept ?? mkdtempSync(join(tmpdir(), 'silmap-browsers-'));
mkdirSync(folder, { recursive: true });

let faults = 0;

async function until(browser, given) {
  const end = Date.now() + TIMEOUT_MS;
  while (Date.now() < end) {
    const answer = await browser.ask(given);
    if (answer) return answer;
    await new Promise((done) => setTimeout(done, 100));
  }
  throw new Error('nothing is drawn in time');
}

const pause = (millis) => new Promise((done) => setTimeout(done, millis));

// The part of the window that the picture is in.
async function pictureOf(browser, name) {
  await pause(800);
  const png = await browser.picture();
  writeFileSync(join(folder, `${name}.png`), png);
  const window = PNG.sync.read(png);
  const part = new PNG({ width: SIZE, height: SIZE });
  PNG.bitblt(window, part, 0, 0, SIZE, SIZE, 0, 0);
  return part.data;
}

// The viewer's picture, in a corner of the window, and the milliseconds until it was there.
async function ofViewer(browser, address, backend, name) {
  const url = new URL(address);
  for (const [key, value] of Object.entries({ ...VIEW, backend })) url.searchParams.set(key, value);
  const since = Date.now();
  await browser.go(url.href);
  const message = await until(browser, () => window.silmap?.then(({ viewer }) => viewer.shown() && 'shown', (error) => `${error?.message ?? error}`));
  const millis = Date.now() - since;
  if (message !== 'shown') throw new Error(message);
  await browser.ask(() => {
    Object.assign(document.getElementById('stage').style, { inset: 'auto', left: 0, top: 0, width: '400px', height: '400px' });
  });
  await pause(500);
  return { millis, pixels: await pictureOf(browser, name) };
}

// The page's picture, in a corner of the window.
async function ofExample(browser, url, name) {
  await browser.go(url);
  const says = await until(browser, () => {
    const text = document.getElementById('message')?.textContent;
    return window.silmapReady || window.silmapBench ? 'shown' : text?.startsWith('This does not work') && text;
  });
  if (says !== 'shown') throw new Error(says);
  await browser.ask(() => {
    Object.assign(document.getElementById('picture').style, { position: 'fixed', inset: 'auto', left: 0, top: 0, width: '400px', height: '400px' });
  });
  await pause(1500);
  return { pixels: await pictureOf(browser, name) };
}

const has = {
  webgl2: () => {
    const context = document.createElement('canvas').getContext('webgl2');
    const names = context?.getExtension('WEBGL_debug_renderer_info');
    return context && context.getParameter(names?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER);
  },
  webgpu: async () => {
    const adapter = await navigator.gpu?.requestAdapter();
    return adapter && (adapter.info?.description || adapter.info?.architecture || adapter.info?.vendor || 'an adapter');
  },
};

function colours(pixels) {
  const seen = new Set();
  for (let k = 0; k < pixels.length; k += 4) seen.add((pixels[k] << 16) | (pixels[k + 1] << 8) | pixels[k + 2]);
  return seen.size;
}

// What a picture is beside the first of its kind, in words.
function beside(references, kind, pixels) {
  if (!references[kind]) {
    references[kind] = pixels;
    if (colours(pixels) < LEAST_COLOURS) faults += 1;
    return 'the others are compared with it';
  }
  const { off, edges, isRight } = compare(references[kind], pixels, SIZE, LIMITS);
  if (!isRight) faults += 1;
  return `${off} pixels of ${edges} at edges differ`;
}

async function tryIn(browser, address, three, references) {
  const name = await browser.name();
  const file = name.replaceAll(/\W+/g, '-').toLowerCase();
  const row = (what, by, result) => console.log(`| ${name} | ${what} | ${by} | ${result} |`);
  await browser.go(address);
  for (const [backend, title] of [['webgl2', 'WebGL2'], ['webgpu', 'WebGPU']]) {
    const device = await browser.ask(has[backend]);
    if (!device) {
      row('viewer', title, 'the browser has none');
      continue;
    }
    try {
      const { millis, pixels } = await ofViewer(browser, address, backend, `viewer-${backend}-${file}`);
      row('viewer', `${title}, ${device}`, `drawn, ${millis} ms; ${beside(references, 'viewer', pixels)}`);
    } catch (error) {
      faults += 1;
      row('viewer', `${title}, ${device}`, error.message);
    }
    for (const example of three ? ['compare', 'instances'] : []) {
      const renderer = backend === 'webgpu' ? '&renderer=webgpu' : '';
      try {
        const { pixels } = await ofExample(browser, `${three.address}/examples/${example}.html?asset=/asset.glb&count=40${renderer}`,
          `${example}-${backend}-${file}`);
        const isDrawn = colours(pixels) >= LEAST_COLOURS;
        if (!isDrawn) faults += 1;
        // Its two renderers smooth edges each in its own way, and what roams is elsewhere each time.
        const compared = example === 'compare' ? `; ${beside(references, backend, pixels)}` : '';
        const result = isDrawn ? `drawn${compared}` : 'empty';
        row(`three.js, ${example}`, title, result);
      } catch (error) {
        faults += 1;
        row(`three.js, ${example}`, title, error.message);
      }
    }
  }
  for (const error of new Set(browser.said())) console.error(`${name}: ${error}`);
}

async function main() {
  const { server, address } = await serveViewer(viewer, page, asset);
  const hasThree = existsSync(join(THREE, 'dist')) && existsSync(join(THREE, 'node_modules/three'));
  const three = hasThree ? await (await import(join(THREE, 'serve.mjs'))).serve({ '/asset.glb': resolve(asset) }) : null;
  const references = {};
  console.log(`Tried on ${new Date().toISOString().slice(0, 10)}.\n\n| browser | page | drawn by | result |\n|---|---|---|---|`);
  try {
    for (const [name, start] of Object.entries(browsers())) {
      if (asked.length > 0 && !asked.includes(name)) continue;
      if (!start) {
        console.error(`skipped: ${name} is not here`);
        continue;
      }
      const browser = await start();
      try {
        await tryIn(browser, address, three, references);
      } finally {
        await browser.close();
      }
    }
  } finally {
    server.kill();
    three?.close();
  }
  if (faults > 0) throw new Error(`${faults} faults`);
}

main().catch((error) => {
  console.error(error.message);
  process.exitCode = 1;
});
