// What the package does besides one hull in the open, in a headless browser: instances, shadows, cameras, files that other programs wrote,
// and what shows when something is amiss.
//
//     npm ci && node test/features.mjs SILMAP ASSET.glb MODEL.ply
//
// Every comparison has a twin that must fail. Exit codes: 0 all is right, 1 something is not, 2 usage.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { PNG } from 'pngjs';
import { PACKAGE, serve } from '../serve.mjs';
import { openBrowser } from './browser.mjs';
import { compare } from './pictures.mjs';

const SIZE = 256;
const [silmap, asset, model, pictures] = process.argv.slice(2);
if (!model || process.argv.length > 6) {
  console.error('usage: node test/features.mjs SILMAP ASSET.glb MODEL.ply [PICTURES]');
  process.exit(2);
}

const work = mkdtempSync(join(tmpdir(), 'silmap-three-'));
const file = (name) => join(work, name);

/** The asset as glTF-Transform writes it, with the class that keeps the extension and without. */
function rewritten() {
  const web = join(PACKAGE, '..');
  const command = join(web, 'node_modules/@gltf-transform/cli/bin/cli.js');
  const transform = (verb, name, ...more) => {
    execFileSync(process.execPath, [command, verb, resolve(asset), file(name), ...more], { stdio: 'ignore' });
    return file(name);
  };
  const config = ['--config', join(web, 'gltf-transform.config.mjs')];
  transform('copy', 'beside.gltf', ...config);
  return {
    '/kept.glb': transform('copy', 'kept.glb', ...config), '/quantised.glb': transform('quantize', 'quantised.glb', ...config),
    '/lost.glb': transform('copy', 'lost.glb'),
  };
}

/** The asset with a byte of its silhouettes changed. */
function damaged() {
  const bytes = readFileSync(asset);
  const length = bytes.readUInt32LE(12);
  const document = JSON.parse(bytes.subarray(20, 20 + length).toString());
  const view = document.bufferViews[document.extensions.SILMAP_silhouette_map.map.silhouettesView];
  bytes[28 + length + (view.byteOffset ?? 0) + (view.byteLength >> 1)] ^= 1;
  return bytes;
}

/** The asset among other meshes: a triangle before the hull, and a second scene that shows the hull alone. */
function amongOthers() {
  const bytes = readFileSync(asset);
  const length = bytes.readUInt32LE(12);
  const document = JSON.parse(bytes.subarray(20, 20 + length).toString());
  const triangle = Buffer.from(Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0).buffer);
  const { buffers, bufferViews, accessors, meshes } = document;
  buffers.push({ byteLength: triangle.length, uri: `data:application/octet-stream;base64,${triangle.toString('base64')}` });
  bufferViews.push({ buffer: buffers.length - 1, byteLength: triangle.length });
  accessors.push({ bufferView: bufferViews.length - 1, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] });
  meshes.unshift({ primitives: [{ attributes: { POSITION: accessors.length - 1 } }] });
  document.nodes = [{ mesh: 0, name: 'triangle' }, { mesh: 1, name: 'hull', scale: [2, 2, 2] }, { mesh: 1, name: 'alone' }];
  document.scenes = [{ nodes: [0, 1] }, { nodes: [2] }];
  const text = Buffer.from(JSON.stringify(document));
  const json = Buffer.concat([text, Buffer.alloc(-text.length & 3, ' ')]);
  const rest = bytes.subarray(20 + length);
  const header = Buffer.from(bytes.subarray(0, 20));
  header.writeUInt32LE(20 + json.length + rest.length, 8);
  header.writeUInt32LE(json.length, 12);
  return Buffer.concat([header, json, rest]);
}

/** A picture turned over, left to right. */
function mirrored(pixels) {
  const turned = Buffer.alloc(pixels.length);
  for (let at = 0; at < SIZE * SIZE; at++) pixels.copy(turned, 4 * (at - (at % SIZE) + SIZE - 1 - (at % SIZE)), 4 * at, 4 * at + 4);
  return turned;
}

/** What the first picture shows, and where it shows nothing the second. */
function together(one, two) {
  const both = Buffer.from(one);
  for (let at = 0; at < both.length; at += 4) if (both[at + 3] === 0) two.copy(both, at, at, at + 4);
  return both;
}

let faults = 0;
async function check(name, test) {
  try {
    console.log(`${name}: ${(await test()) ?? 'right'}`);
  } catch (error) {
    faults += 1;
    console.error(`${name}: ${error.message.slice(0, 400)}`);
  }
}

const differing = (one, two) => {
  const { off, edges, inside } = compare(one, two, SIZE);
  return { off, edges, inside };
};

/** Asserts that two pictures are the same and a third is not. */
function assertSame(one, two, wrong, share = 0.01) {
  const [same, other] = [differing(one, two), differing(one, wrong)];
  assert(same.edges > SIZE, 'nothing is shown');
  assert(same.off <= share * same.edges, `${same.off} pixels differ, of ${same.edges} at edges`);
  assert(other.off > 4 * Math.max(same.off, 0.01 * same.edges), `a mistake goes unnoticed: ${other.off} pixels differ, ${same.off} without it`);
  return `${same.off} pixels differ, ${other.off} with a mistake`;
}

const picture = (text) => Buffer.from(text, 'base64');

/** What programs do with what was loaded. */
async function checkUses(page, renderer) {
  const said = (name) => `${renderer}, ${name}`;
  await check(said('the hull alone is clipped in a file of several meshes and scenes'), async () => {
    assert.deepEqual(await page.use('names', '/among.glb'), [[['triangle', false], ['hull', true]], [['alone', true]]]);
  });
  await check(said('two assets in a scene are each clipped by its own'), async () => {
    const { alone, both } = await page.use('twoAssets', ['/asset.glb', '/quantised.glb']);
    const [left, right] = alone.map(picture);
    return assertSame(together(left, right), picture(both), left, 0.001);
  });
  await check(said('a mirrored node is clipped as in a mirror'), async () => {
    const [as, turned, plain] = (await page.use('mirrored', '/asset.glb')).map(picture);
    return assertSame(as, mirrored(turned), mirrored(plain), 0.001);
  });
  await check(said('an eye within the sphere sees the whole hull'), async () => {
    const [seen, plain] = (await page.use('inside', '/asset.glb')).map(picture);
    return assertSame(seen, plain, mirrored(plain), 0.001);
  });
  await check(said('a clone is clipped, and JSON gives the plain hull back'), async () => {
    const { isKept, ...found } = await page.use('copies', '/asset.glb');
    const [original, copy, plain, parsed] = [found.original, found.copy, found.plain, found.parsed].map(picture);
    assert(isKept, 'the mesh has another material after it was stored');
    return `${assertSame(original, copy, plain, 0.001)}; ${assertSame(plain, parsed, original, 0.001)}`;
  });
  await check(said('two renderers that take turns draw the same'), async () => {
    const [first, ...others] = (await page.use('inTurns', '/asset.glb')).map(picture);
    return others.map((other) => assertSame(first, other, mirrored(first), 0.001)).join('; ');
  });
  if (renderer === 'webgl') {
    await check(said('a lost context that is restored shows the same'), async () => {
      const { before, after, plain } = await page.use('lostContext', '/asset.glb');
      return assertSame(picture(before), picture(after), picture(plain), 0.001);
    });
  }
  await check(said('an asset that is loaded and let go 50 times leaves nothing'), async () => {
    const { heap, worker, geometries, textures } = await page.use('reload', '/asset.glb', [10, 50]);
    assert(heap[1] - heap[0] < 8 << 20 && worker[1] === worker[0], `memory grows: ${heap}, ${worker}`);
    assert.deepEqual([geometries[1], textures[1]], [geometries[0], textures[0]]);
  });
  await page.close();
}

async function main() {
  const { center, radius } = JSON.parse(execFileSync(silmap, ['inspect', asset, '--json'], { stdio: ['ignore', 'pipe', 'ignore'] })).model;
  const others = rewritten();
  const beside = Object.fromEntries(JSON.parse(readFileSync(file('beside.gltf'))).buffers.concat(JSON.parse(readFileSync(file('beside.gltf'))).images)
    .filter(({ uri }) => uri).map(({ uri }) => [`/${uri}`, file(uri)]));
  const files = { '/asset.glb': asset, '/model.ply': model, '/damaged.glb': damaged(), '/among.glb': amongOthers(), '/beside.gltf': file('beside.gltf'), ...beside, ...others };
  const server = await serve(files);
  const broken = await serve({ ...files, '/dist/silmap_outlines_bg.wasm': file('nothing') });
  const browser = await openBrowser();
  try {
    const open = async (query, { address } = server) => {
      const tab = await browser.newPage();
      tab.on('pageerror', (error) => console.error(error.message));
      await tab.goto(`${address}/test/page.html?${query}`);
      await tab.waitForFunction(() => window.silmapTest?.use);
      const run = async (what, options) => {
        const shown = await tab.evaluate(([name, o]) => window.silmapTest[name](o), [what, options]);
        shown.pixels = Buffer.from(shown.pixels, 'base64');
        if (pictures) {
          const png = new PNG({ width: SIZE, height: SIZE });
          shown.pixels.copy(png.data);
          writeFileSync(join(pictures, `${query.replace(/\W/g, '-')}-${JSON.stringify(options).replace(/[^\w]+/g, '-').slice(0, 150)}.png`), PNG.sync.write(png));
        }
        return shown;
      };
      const eye = [1.1, 0.9, 2.6].map((x, k) => center[k] + radius * x);
      return {
        scene: (options) => run('drawScene', { file: '/asset.glb', size: SIZE, ...options }),
        draw: (options) => run('draw', { file: '/asset.glb', size: SIZE, eye, target: center, fov: 45, options: { reuseErrorPx: 0 }, ...options }),
        use: (...given) => tab.evaluate((what) => window.silmapTest.use(...what), given),
        close: () => tab.close(),
      };
    };
    for (const renderer of ['webgl', 'webgpu', 'webgpu&force-webgl=1']) await checkUses(await open(`renderer=${renderer}`), renderer);
    for (const renderer of ['webgl', 'webgpu']) {
      const page = await open(`renderer=${renderer}`);
      const said = (name) => `${renderer}, ${name}`;
      const plain = await page.draw({ file: '/lost.glb' });
      const clipped = await page.draw({});
      await check(said('instances are drawn as meshes are'), async () => {
        const drawn = [];
        for (const what of ['mesh', 'instanced', 'plain']) drawn.push((await page.scene({ what, fog: false, lit: false })).pixels);
        return assertSame(...drawn);
      });
      for (const light of ['directional', 'point']) {
        await check(said(`the shadow of a ${light} light is that of the full mesh`), async () => {
          const of = async (what) => (await page.scene({ what, light, count: 1, fog: false, shadowOnly: true, eye: [2, 5, 4] })).pixels;
          const [full, ours, hull] = [await of('full'), await of('mesh'), await of('plain')];
          const [right, wrong] = [differing(full, ours).off, differing(full, hull).off];
          assert(wrong > 100 && right < 0.4 * wrong, `${right} pixels differ from the full mesh's, ${wrong} of the plain hull's`);
          return `${right} pixels differ from the full mesh's, ${wrong} of the plain hull's`;
        });
      }
      await check(said('an object that is turned, scaled and moved shows as itself'), async () =>
        assertSame(clipped.pixels, (await page.draw({ moved: true })).pixels, plain.pixels, 0.02));
      await check(said('an orthographic camera is an eye far away'), async () => {
        const far = [1.1, 0.9, 2.6].map((x, k) => center[k] + 400 * radius * x);
        const fov = (2 * Math.atan(1.2 / Math.hypot(440, 360, 1040)) * 180) / Math.PI;
        const distant = await page.draw({ eye: far, fov, far: 1e5 });
        const flat = await page.draw({ orthographic: 1.2 * radius });
        const hull = await page.draw({ orthographic: 1.2 * radius, file: '/lost.glb' });
        return assertSame(distant.pixels, flat.pixels, hull.pixels, 0.03);
      });
      for (const name of ['kept.glb', 'quantised.glb', 'beside.gltf']) {
        await check(said(`${name}, which glTF-Transform wrote with the class, is clipped`), async () => {
          const shown = await page.draw({ file: `/${name}` });
          assert.deepEqual([shown.warnings, shown.clipped], [[], [true]]);
          // Quantised vertices are elsewhere, by a fraction of a pixel.
          return assertSame(clipped.pixels, shown.pixels, plain.pixels, name === 'quantised.glb' ? 0.1 : 0.001);
        });
      }
      await check(said('a file that lost its extension shows the plain hull'), async () => {
        const asIs = await page.draw({ options: { plain: true } });
        assert.deepEqual([plain.warnings, plain.clipped], [[], [false]]);
        return assertSame(plain.pixels, asIs.pixels, clipped.pixels, 0.001);
      });
      await check(said('a damaged file shows the plain hull and says so once'), async () => {
        const shown = await page.draw({ file: '/damaged.glb' });
        assert.equal(shown.warnings.length, 1, shown.warnings.join('\n'));
        assert.match(shown.warnings[0], /the plain hull is shown.*damaged/);
        return `${assertSame(plain.pixels, shown.pixels, clipped.pixels, 0.001)}; ${shown.warnings[0]}`;
      });
      await page.close();
      await check(said('without a worker the page makes outlines itself'), async () => {
        const alone = await open(`renderer=${renderer}&no-worker=1`);
        const shown = await alone.draw({});
        await alone.close();
        assert.deepEqual(shown.warnings, []);
        return assertSame(clipped.pixels, shown.pixels, plain.pixels, 0.001);
      });
      await check(said('without the module the plain hull shows, and a warning'), async () => {
        const without = await open(`renderer=${renderer}`, broken);
        const shown = await without.draw({});
        await without.close();
        assert.equal(shown.warnings.length, 1, shown.warnings.join('\n'));
        return `${assertSame(plain.pixels, shown.pixels, clipped.pixels, 0.001)}; ${shown.warnings[0]}`;
      });
    }
  } finally {
    await browser.close();
    server.close();
    broken.close();
    rmSync(work, { recursive: true, force: true });
  }
  if (faults > 0) throw new Error(`${faults} checks failed`);
}

main().catch((error) => {
  console.error(error.message);
  process.exitCode = 1;
});
