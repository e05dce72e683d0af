// A headless Chromium, and pictures compared: what the programs of this folder share.
import { existsSync } from 'node:fs';
import { delimiter, join } from 'node:path';
import { chromium } from 'playwright-core';

const BROWSERS = [process.env.CHROMIUM, 'chromium', 'chromium-browser', 'google-chrome'].filter(Boolean);
const FLAGS = [
  '--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
  '--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader', '--enable-unsafe-swiftshader',
];

// Beside an edge our picture differs by more than so many steps of 255.
const EDGE_STEPS = 12;
// How many pixels at edges may be no neighbour's: of spikes narrower than a pixel each adapter draws other pixels. Up to six were seen.
const UNEXPLAINED_AT_MOST = 0.0015;

function browserPath() {
  const places = (name) => name.includes('/') ? [name] : (process.env.PATH ?? '').split(delimiter).map((p) => join(p, name));
  const found = BROWSERS.flatMap(places).find((path) => existsSync(path));
  if (!found) throw new Error('no Chromium is here: install it, or say where it is by CHROMIUM');
  return found;
}

export function launch() {
  return chromium.launch({ executablePath: browserPath(), args: FLAGS });
}

// On the display that DISPLAY names: without one Chromium 156 loses the device of a canvas that is drawn by WebGPU.
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
