// A headless Chromium, and pictures compared: what the programs of this folder share.
import { spawn } from 'node:child_process';
import { chromium } from 'playwright-core';
import { FLAGS, browserPath } from './chromium.mjs';

// Beside an edge our picture differs by more than so many steps of 255.
const EDGE_STEPS = 12;
// How many pixels at edges may be no neighbour's: of spikes narrower than a pixel each adapter draws other pixels. Up to six were seen.
const UNEXPLAINED_AT_MOST = 0.0015;

export function launch() {
  return chromium.launch({ executablePath: browserPath(), args: FLAGS });
}

// On the display that DISPLAY names: without one Chromium 148 loses the device of a canvas that is drawn by WebGPU.
export function launchOnDisplay() {
  if (!process.env.DISPLAY) throw new Error('a display is needed: see on_a_display in tools/machine.bash');
  const args = [...FLAGS, '--enable-features=Vulkan', '--use-vulkan=swiftshader'];
  return chromium.launch({ executablePath: browserPath(), args, headless: false });
}

const CHANNELS = [0, 1, 2, 3];

// How many pixels are at edges of our picture, how many are off by more than `steps` of 255, and how many of those no neighbour explains.
// Pictures are right where `offAtMost` of the pixels at edges are off. Both have four bytes a pixel and `width` columns.
export function compare(ours, theirs, width, { steps, offAtMost }) {
  const count = ours.length / 4;
  const channel = (pixels, pixel, c) => pixels[4 * pixel + c];
  const around = (pixel) => [-width, 0, width].flatMap((row) => [-1, 0, 1].map((column) => pixel + row + column));
  const found = { edges: 0, off: 0, unexplained: 0 };
  for (let pixel = 0; pixel < count; pixel++) {
    const neighbours = around(pixel).filter((p) => p >= 0 && p < count);
    const ranges = CHANNELS.map((c) => {
      const values = neighbours.map((p) => channel(ours, p, c));
      return [Math.min(...values), Math.max(...values)];
    });
    if (ranges.some(([least, most]) => most - least > EDGE_STEPS)) found.edges += 1;
    if (CHANNELS.every((c) => Math.abs(channel(ours, pixel, c) - channel(theirs, pixel, c)) <= steps)) continue;
    found.off += 1;
    const isExplained = ranges.every(([least, most], c) => {
      const value = channel(theirs, pixel, c);
      return value >= least - steps && value <= most + steps;
    });
    if (!isExplained) found.unexplained += 1;
  }
  const { edges, off, unexplained } = found;
  return { ...found, isRight: edges > width && off <= offAtMost * edges && unexplained <= UNEXPLAINED_AT_MOST * edges };
}

// The viewer's own server: its process, and the address of the page with an asset.
export function serveViewer(viewer, page, asset) {
  const server = spawn(viewer, [asset, '--web', '--page', page], { stdio: ['ignore', 'ignore', 'pipe'] });
  return new Promise((resolve, reject) => {
    let said = '';
    server.stderr.on('data', (text) => {
      said += text;
      const found = said.match(/http:\S+/);
      if (found) resolve({ server, address: found[0] });
    });
    server.on('exit', () => reject(new Error(said)));
  });
}

// Waits until a page gives something; what it gives may be a promise.
export async function until(tab, given, mostMillis) {
  const end = Date.now() + mostMillis;
  while (Date.now() < end) {
    const found = await tab.evaluate(given);
    if (found) return found;
    await tab.waitForTimeout(10);
  }
  throw new Error(`in vain: ${given}`);
}
