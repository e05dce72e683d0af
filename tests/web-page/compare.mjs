// Draws an asset in a headless browser by WebGPU and WebGL2 and compares the pictures with those of a native program.
//
//     npm ci && node compare.mjs PAGE ASSET.glb HEADLESS [PICTURES]
//
// PAGE is the folder that `cargo xtask example-web` builds, HEADLESS the program `example-headless`. Both draw by the same renderer, so that
// pictures may differ at edges alone, where adapters round differently: at a few pixels, and there by no more than if what is drawn
// were moved to a neighbour. The picture of an eye that is turned by a little must be farther off: a comparison that lets everything
// pass is worth nothing. Pictures are left in PICTURES, to be looked at.
//
// Exit codes: 0 the pictures agree, 1 they do not (or none could be drawn), 2 usage.
import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { tmpdir } from 'node:os';
import { extname, join, normalize } from 'node:path';
import { PNG } from 'pngjs';
import { compare, launch } from './browser.mjs';

const SIZE = 256;
const SCENES = [{ eye: [1.5, 1, 3], copies: 1 }, { eye: [-2, 0.4, 1.1], copies: 3 }];
// The negative control: it moves an outline by about a pixel.
const TURN_DEGREES = 1;
const TIMEOUT_MS = 120_000;
// How far a channel may be off, in steps of 255, where a pixel is not counted; and how many pixels may be off by more, as a share of
// those where our picture has an edge. SwiftShader rounds vertices to 1/16 pixel,
// others to 1/256: up to 0.6 % were seen.
const KINDS = [
  // Without smoothing a pixel is in or out.
  { clip: 'stencil', edges: 'hard', steps: 8, offAtMost: 0.01 },
  { clip: 'coverage', edges: 'hard', steps: 8, offAtMost: 0.01 },
  { clip: 'coverage', edges: 'soft', steps: 8, offAtMost: 0.01 },
  // Where the samples of a pixel lie is up to the adapter.
  { clip: 'stencil', edges: 'samples', steps: 40, offAtMost: 0.01 },
  // So is in WebGL2 how many of them a share of coverage sets, and which: up to 1.1 % were seen.
  { clip: 'coverage', edges: 'samples', steps: 40, offAtMost: 0.02 },
];
const [page, asset, headless, kept] = process.argv.slice(2);
if (!headless || process.argv.length > 6) {
  console.error('usage: node compare.mjs PAGE ASSET.glb HEADLESS [PICTURES]');
  process.exit(2);
}

function serve() {
  const types = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm' };
  return createServer((request, response) => {
    const { pathname } = new URL(request.url, 'http://localhost');
    const name = pathname === '/' ? 'index.html' : normalize(pathname).slice(1);
    const file = name === 'asset.glb' ? asset : join(page, name);
    if (!existsSync(file)) {
      // Browsers ask for an icon.
      response.writeHead(name === 'favicon.ico' ? 204 : 404).end();
      return;
    }
    response.setHeader('content-type', types[extname(file)] ?? 'application/octet-stream');
    response.end(readFileSync(file));
  });
}

function native({ clip, edges }, { eye, copies }, folder) {
  const file = join(folder, `${clip}-${edges}-native-${copies}.png`);
  const args = [asset, file, `--from=${eye.join()}`, '--copies', copies, '--size', SIZE, '--clip', clip, '--edges', edges];
  const said = execFileSync(headless, args, { encoding: 'utf8' });
  return { pixels: PNG.sync.read(readFileSync(file)).data, adapter: said.trim().replace(/^drawn by /, '') };
}

async function inBrowser(tab, address) {
  await tab.goto(address);
  const found = await tab.evaluate(async () => {
    try {
      const { adapter, rgba } = await window.picture;
      let text = '';
      for (let at = 0; at < rgba.length; at += 4096) text += String.fromCharCode(...rgba.subarray(at, at + 4096));
      return { adapter, base64: btoa(text) };
    } catch (error) {
      return { error: error.message };
    }
  });
  if (found.error) throw new Error(found.error);
  return { adapter: found.adapter, pixels: Buffer.from(found.base64, 'base64') };
}

function turned({ eye: [x, y, z], copies }) {
  const angle = (TURN_DEGREES * Math.PI) / 180;
  return { eye: [x * Math.cos(angle) + z * Math.sin(angle), y, z * Math.cos(angle) - x * Math.sin(angle)], copies };
}

function save(folder, name, pixels) {
  const png = new PNG({ width: SIZE, height: SIZE });
  Buffer.from(pixels).copy(png.data);
  writeFileSync(join(folder, name), PNG.sync.write(png));
}

async function main() {
  const work = mkdtempSync(join(tmpdir(), 'silmap-web-page-'));
  if (kept) mkdirSync(kept, { recursive: true });
  const folder = kept ?? work;
  const server = serve();
  let browser;
  let faults = 0;
  try {
    await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
    browser = await launch();
    const tab = await browser.newPage();
    tab.setDefaultTimeout(TIMEOUT_MS);
    tab.on('console', (message) => message.type() === 'error' && console.error(message.text()));
    const { port } = server.address();
    const draw = (backend, { clip, edges }, { eye, copies }) => {
      const query = new URLSearchParams({ asset: 'asset.glb', backend, clip, edges, copies, size: SIZE, from: eye.join() });
      return inBrowser(tab, `http://127.0.0.1:${port}/?${query}`);
    };
    for (const kind of KINDS) {
      for (const scene of SCENES) {
        const ours = native(kind, scene, folder);
        for (const backend of ['webgpu', 'webgl2']) {
          const theirs = await draw(backend, kind, scene);
          save(folder, `${kind.clip}-${kind.edges}-${backend}-${scene.copies}.png`, theirs.pixels);
          const right = compare(ours.pixels, theirs.pixels, SIZE, kind);
          const wrong = compare(ours.pixels, (await draw(backend, kind, turned(scene))).pixels, SIZE, kind);
          console.log(
            `${kind.clip}, ${kind.edges}, ${scene.copies}: ${theirs.adapter} and ${ours.adapter} differ at ${right.off} pixels of ${right.edges} at `
              + `edges, ${right.unexplained} of them no neighbour's; from an eye ${TURN_DEGREES}° aside at ${wrong.off}`);
          if (!right.isRight) console.error('the pictures differ');
          if (wrong.isRight) console.error('a turn goes unnoticed');
          if (!right.isRight || wrong.isRight) faults += 1;
        }
      }
    }
  } finally {
    await browser?.close();
    server.close();
    server.closeAllConnections();
    rmSync(work, { recursive: true, force: true });
  }
  if (faults > 0) throw new Error(`${faults} comparisons failed`);
}

main().catch((error) => {
  console.error(error.message);
  process.exitCode = 1;
});
