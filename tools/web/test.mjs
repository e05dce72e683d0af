// What glTF-Transform does to an asset, with the extension class and without: `node test.mjs SILMAP`, the path of the binary.
//
// With the class the silhouette map is read as before after every transform, and draws the same outline; without it the file says
// what happened and how to go on.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, statSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const silmap = resolve(process.argv[2] ?? join(here, '../../target/debug/silmap'));
const command = join(here, 'node_modules/@gltf-transform/cli/bin/cli.js');
const config = ['--config', join(here, 'gltf-transform.config.mjs')];
const folder = mkdtempSync(join(tmpdir(), 'silmap-web-'));
const path = (name) => join(folder, name);
const json = (...args) => JSON.parse(execFileSync(silmap, [...args, '--json'], { stdio: ['ignore', 'pipe', 'ignore'] }));
const refused = (...args) => {
  const { status, stderr } = spawnSync(silmap, args, { encoding: 'utf8' });
  assert.equal(status, 1, stderr);
  return stderr;
};
const transform = (args) => execFileSync(process.execPath, [command, ...args], { stdio: ['ignore', 'ignore', 'inherit'] });
// From a place about the asset, which a program may have moved with its scene.
const outline = (file) => {
  const { center } = json('inspect', file).model;
  const eye = [1.5, 2, 2.5].map((x, k) => x + center[k]);
  return json('contour', file, `--eye=${eye}`).loops;
};
const assertSame = (one, two, message) => {
  const [a, b] = [one, two].map((loops) => loops.flat(2));
  assert.deepEqual(one.map((l) => l.length), two.map((l) => l.length), message);
  assert(a.every((x, k) => Math.abs(x - b[k]) < 1e-3), message);
};

try {
  const [model, asset] = [path('torus.ply'), path('torus.glb')];
  execFileSync(silmap, ['generate', 'torus', '--faces', '1200', '-o', model]);
  json('build', model, '-o', asset, '--views', '64', '--keep', '20', '--resolution', '96', '--faces', '120',
    '--texture-views', '4', '--texture-size', '32', '--atlas-size', '64', '--backend', 'cpu');
  const before = json('inspect', asset);
  const drawn = outline(asset);

  // What keeps the hull as it is, and what does not: the map is the asset's all the same.
  const sameHull = ['simplify', 'weld', 'join', 'compress', 'texture-compress'].flatMap((what) => [`--${what}`, 'false']);
  const transforms = {
    copy: ['copy'], dedup: ['dedup'], prune: ['prune'], weld: ['weld'], quantize: ['quantize'], reorder: ['reorder'],
    center: ['center'], meshopt: ['meshopt'], simplify: ['simplify', '--ratio', '0.5', '--error', '0.1'],
    webp: ['webp'], optimize: ['optimize'], careful: ['optimize'],
  };
  for (const [name, [verb, ...options]] of Object.entries(transforms)) {
    const [kept, lost] = [path(`kept-${name}.glb`), path(`lost-${name}.glb`)];
    const more = name === 'careful' ? [...options, ...sameHull] : options;
    transform([verb, asset, kept, ...more, ...config]);
    const after = json('inspect', kept);
    // `center` moves the scene, and the asset with it.
    if (name === 'center') after.model.center = before.model.center;
    for (const part of ['map', 'hull', 'textures', 'model']) assert.deepEqual(after[part], before[part], `${name}: ${part}`);
    assertSame(outline(kept), drawn, name);
    // Once more, so that what was written can be read by the class too.
    transform(['copy', kept, path('twice.glb'), ...config]);
    assertSame(outline(path('twice.glb')), drawn, `${name}, twice`);

    transform([verb, asset, lost, ...more]);
    const sentence = refused('inspect', lost);
    assert.match(sentence, /no silhouette map any more: glTF-Transform/, name);
    assert.match(sentence, /silmap attach/);
    // The data are put back unless the hull was changed.
    const back = path(`back-${name}.glb`);
    const { status, stderr } = spawnSync(silmap, ['attach', lost, '--from', asset, '-o', back], { encoding: 'utf8' });
    if (status === 0) assertSame(outline(back), drawn, `${name}, attached`);
    else assert.match(stderr, /hull is not the asset's any more|is compressed by/, name);
    const mayDiffer = ['meshopt', 'simplify', 'optimize'].includes(name);
    assert(status === 0 || mayDiffer, stderr);
    const bytes = [asset, kept].map((file) => statSync(file).size);
    console.log(`${name}: ${bytes[0]} bytes, ${bytes[1]} with the class; without it ${status === 0 ? 'attached' : stderr.trim()}`);
  }
  // A careful run stores the hull once: its arrays are the mesh's own.
  const careful = readFileSync(path('kept-careful.glb'));
  const length = careful.readUInt32LE(12);
  const document = JSON.parse(careful.subarray(20, 20 + length).toString());
  const { positionsAccessor } = document.extensions.SILMAP_silhouette_map.hull;
  assert.equal(positionsAccessor, document.meshes[0].primitives[0].attributes.POSITION);
  console.log('silhouette maps survive glTF-Transform');
} finally {
  rmSync(folder, { recursive: true });
}
