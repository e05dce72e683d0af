// Drives the viewer's page in a browser, on a display that need not be seen, by WebGPU and WebGL2: pictures beside those of `silmap render`, what is refused, sizes
// of the window, a lost device, and what is around the picture (around.mjs).
//
//     npm ci && node viewer.mjs PAGE ASSET.glb VIEWER SILMAP [PICTURES]
//
// PAGE is the folder that `cargo xtask web` makes; VIEWER serves it. Pictures are left in PICTURES, to be looked at. Times to the first
// picture are printed.
//
// Exit codes: 0 all is as it should be, 1 it is not, 2 usage.
import { execFileSync } from 'node:child_process';
import { copyFileSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { PNG } from 'pngjs';
import * as around from './around.mjs';
import { compare, launchOnDisplay, serveViewer, until as untilIn } from './browser.mjs';

const SIZE = 400;
const EYES = ['1.5,1,3', '-2.2,0.6,1.4'];
const TURNED = '1.45,1,3.03';
const LIMITS = { steps: 10, offAtMost: 0.02 };
const TIMEOUT_MS = 120_000;
const until = (tab, given) => untilIn(tab, given, TIMEOUT_MS);

const [page, asset, viewer, silmap, kept] = process.argv.slice(2);
if (!silmap || process.argv.length > 7) {
  console.error('usage: node viewer.mjs PAGE ASSET.glb VIEWER SILMAP [PICTURES]');
  process.exit(2);
}

let faults = 0;
function expect(is, what) {
  if (is) return;
  console.error(`fault: ${what}`);
  faults += 1;
}

const look = (eye) => ({ eye, target: '0,0,0', fov: '40' });

function native(eye, folder) {
  const file = join(folder, `native-${eye}.png`);
  execFileSync(silmap, ['render', asset, `--eye=${eye}`, '--target=0,0,0', '--fov', '40', '--size', `${SIZE}x${SIZE}`,
    '--background', '#f4f5f7', '-o', file], { stdio: ['ignore', 'ignore', 'pipe'] });
  return PNG.sync.read(readFileSync(file)).data;
}

// Waits for the first picture, and returns the milliseconds that it took.
async function open(tab, address, query) {
  const since = Date.now();
  const url = new URL(address);
  for (const [key, value] of Object.entries(query)) url.searchParams.set(key, value);
  await tab.goto(url.href);
  await until(tab, async () => {
    const { viewer } = await window.silmap;
    return viewer.shown() ?? viewer.message();
  });
  return Date.now() - since;
}

async function picture(tab, file) {
  // Frames that are under way come first.
  await tab.waitForTimeout(300);
  const bytes = await tab.screenshot(file ? { path: file } : {});
  return PNG.sync.read(bytes).data;
}

async function drive(browser, address, backend, folder) {
  const tab = await browser.newPage({ viewport: { width: SIZE, height: SIZE } });
  tab.setDefaultTimeout(TIMEOUT_MS);
  tab.on('pageerror', (error) => expect(false, `${backend}: ${error.message}`));
  for (const eye of EYES) {
    const millis = await open(tab, address, { ...look(eye), bare: '', backend });
    const ours = native(eye, folder);
    const theirs = await picture(tab, join(folder, `${backend}-${eye}.png`));
    const right = compare(ours, theirs, SIZE, LIMITS);
    console.log(`${backend}, eye ${eye}: first picture after ${millis} ms; ${right.off} pixels of ${right.edges} at edges differ from `
      + `the native picture, ${right.unexplained} of them no neighbour's`);
    expect(right.isRight, `${backend}: the picture from ${eye} differs`);
    if (eye === EYES[0]) {
      const wrong = compare(native(TURNED, folder), theirs, SIZE, LIMITS);
      expect(!wrong.isRight, `${backend}: a turn goes unnoticed`);
    }
  }
  const before = await picture(tab);
  const same = async (what) => {
    const now = await picture(tab);
    expect(Buffer.compare(before, now) === 0, `${backend}: the picture is another after ${what}`);
  };

  // Nothing is taken from the page before the picture has the focus.
  for (const isFocused of [false, true]) {
    await tab.evaluate((focus) => {
      const canvas = document.querySelector('canvas');
      if (focus) canvas.focus(); else canvas.blur();
    }, isFocused);
    await tab.mouse.move(SIZE / 2, SIZE / 2);
    await tab.evaluate(() => {
      window.wheels = [];
      document.querySelector('canvas').addEventListener('wheel', (event) => {
        // Once all who listen have heard it.
        setTimeout(() => window.wheels.push(event.defaultPrevented));
      }, { capture: true });
    });
    await tab.mouse.wheel(0, 40);
    await until(tab, () => window.wheels.length > 0);
    await tab.waitForTimeout(100);
    const isTaken = await tab.evaluate(() => window.wheels[0]);
    expect(isTaken === isFocused, `${backend}: the wheel is ${isTaken ? '' : 'not '}taken from the page, focus ${isFocused}`);
  }

  // What cannot be opened is said, and what was there stays.
  await open(tab, address, { ...look(EYES[1]), bare: '', backend });
  for (const [name, says] of [['asset/nothing.glb', '404'], ['viewer.js', 'viewer.js']]) {
    await tab.evaluate(async (url) => (await window.silmap).viewer.open(url), name);
    const text = await until(tab, async () => (await window.silmap).viewer.message());
    expect(text.includes(says), `${backend}: ${name}: ${text}`);
    expect(await tab.evaluate(async () => (await window.silmap).viewer.shown()) !== undefined, `${backend}: it is gone`);
    await tab.evaluate(async () => (await window.silmap).viewer.dismiss());
  }
  await same('files that cannot be opened');

  // To nothing and back.
  await tab.evaluate(() => { document.getElementById('stage').style.display = 'none'; });
  await tab.waitForTimeout(200);
  await tab.evaluate(() => { document.getElementById('stage').style.display = ''; });
  await same('it had no size');

  // With bar and controls, in windows of all sizes.
  for (const [width, height] of [[320, 560], [1000, 700], [2560, 1300]]) {
    await tab.setViewportSize({ width, height });
    await open(tab, address, { ...look(EYES[0]), backend });
    await picture(tab, join(folder, `${backend}-window-${width}.png`));
    const place = await tab.evaluate(async () => Array.from((await window.silmap).viewer.picture()));
    expect(place[2] > 0.6 * Math.min(width, 1900) && place[3] > 0.5 * height, `${backend}: ${width}: the picture has ${place}`);
    const isWider = await tab.evaluate(() => document.documentElement.scrollWidth > innerWidth);
    expect(!isWider, `${backend}: ${width}: the page scrolls sideways`);
  }

  // What is around the picture.
  await tab.setViewportSize({ width: SIZE, height: SIZE });
  const told = (is, what) => expect(is, `${backend}: ${what}`);
  const given = { tab, address, look: { ...look(EYES[0]), backend }, asset: readFileSync(asset), expect: told, until, open, picture, size: SIZE };
  await around.posterUntilTheFirstFrame(given);
  await around.savedPicture(given);
  await around.fewerViews(given);
  await around.droppedFiles(given);
  await around.keyboardAlone(given);
  await around.embedded(given);

  // A device that is lost comes back.
  await tab.setViewportSize({ width: SIZE, height: SIZE });
  await open(tab, address, { ...look(EYES[1]), bare: '', backend });
  if (backend === 'webgl2') {
    await tab.evaluate(() => {
      document.querySelector('canvas').getContext('webgl2').getExtension('WEBGL_lose_context').loseContext();
    });
    await until(tab, async () => window.restarts === 1 && (await window.silmap).viewer.shown());
    await same('the device was lost');
  }
  await tab.close();
}

async function main() {
  const work = mkdtempSync(join(tmpdir(), 'silmap-viewer-'));
  const folder = kept ?? work;
  mkdirSync(folder, { recursive: true });
  const served = join(work, 'asset.glb');
  copyFileSync(asset, served);
  const { server, address } = await serveViewer(viewer, page, served);
  const browser = await launchOnDisplay();
  try {
    for (const backend of ['webgpu', 'webgl2']) await drive(browser, address, backend, folder);
  } finally {
    await browser.close();
    server.kill();
    rmSync(work, { recursive: true, force: true });
  }
  if (faults > 0) throw new Error(`${faults} faults`);
}

main().catch((error) => {
  console.error(error.message);
  process.exitCode = 1;
});
