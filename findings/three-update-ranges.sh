#!/usr/bin/env bash
# three.js loses partial updates where two renderers share a texture or an attribute. Seen with three 0.187.0 and Chromium, WebGLRenderer.
# `addUpdateRange` says what changed; the first renderer that draws sends it and clears the ranges. A renderer that draws less often then sends the
# ranges that were added since, as if it had seen the ones before, and shows old data for good. Without ranges each renderer compares versions
# and sends all that it lacks. Here a texture of two rows and an attribute with two colours change in the upper half, a first renderer draws,
# they change in the lower half, and both draw: the second still has the old upper half.
#
# Node, npm and Chromium are needed. Exit code 1 when this changes.
set -euo pipefail

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
npm install --loglevel=error --no-audit --no-fund --prefix "$work" three@0.187.0 playwright-core@1.56.1

cat >"$work/page.js" <<'JS'
import * as THREE from './node_modules/three/build/three.module.js';

const makeRenderer = () => {
  const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true });
  renderer.setSize(8, 8);
  return renderer;
};
const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 1);

/** Green of the upper and of the lower half as a renderer shows them. */
const halves = (renderer, scene) => {
  renderer.render(scene, camera);
  const gl = renderer.getContext();
  return [6, 1].map((y) => {
    const pixel = new Uint8Array(4);
    gl.readPixels(4, y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return pixel[1] > 127 ? 'new' : 'old';
  });
};

function ofTexture() {
  const texture = new THREE.DataTexture(new Uint8Array([255, 0, 0, 255, 255, 0, 0, 255]), 1, 2);
  texture.needsUpdate = true;
  const scene = new THREE.Scene().add(new THREE.Mesh(new THREE.PlaneGeometry(2, 2), new THREE.MeshBasicMaterial({ map: texture })));
  // Rows begin below.
  return { scene, shared: texture, array: texture.image.data, green: [0, 255, 0, 255], lower: 0, upper: 4 };
}

function ofAttribute() {
  const geometry = new THREE.PlaneGeometry(2, 2, 1, 3);
  const colors = new THREE.BufferAttribute(new Float32Array(24).map((_, k) => (k % 3 === 0 ? 1 : 0)), 3);
  geometry.setAttribute('color', colors);
  const scene = new THREE.Scene().add(new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ vertexColors: true })));
  // Vertices begin above: two rows of two for each half.
  return { scene, shared: colors, array: colors.array, green: [0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0], lower: 12, upper: 0 };
}

window.found = (withRanges) => Object.fromEntries([ofTexture, ofAttribute].map((make) => {
  const { scene, shared, array, green, lower, upper } = make();
  const [often, seldom] = [makeRenderer(), makeRenderer()];
  const change = (start) => {
    array.set(green, start);
    if (withRanges) shared.addUpdateRange(start, green.length);
    shared.needsUpdate = true;
  };
  halves(often, scene);
  halves(seldom, scene);
  change(upper);
  halves(often, scene);
  change(lower);
  return [make.name, [halves(seldom, scene), halves(often, scene)].map((both) => both.join(' '))];
}));
JS

cat >"$work/run.mjs" <<'JS'
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { chromium } from 'playwright-core';

const folder = new URL('.', import.meta.url).pathname;
const executablePath = process.env.CHROMIUM ?? '/usr/bin/chromium';
const browser = await chromium.launch({ executablePath, args: ['--no-sandbox', '--enable-unsafe-swiftshader'] });
try {
  const page = await browser.newPage();
  await page.route('http://page/**', (route) => {
    const { pathname } = new URL(route.request().url());
    if (pathname === '/') return route.fulfill({ contentType: 'text/html', body: '<script type="module" src="page.js"></script>' });
    return route.fulfill({ contentType: 'text/javascript', body: readFileSync(folder + pathname.slice(1)) });
  });
  await page.goto('http://page/');
  await page.waitForFunction(() => window.found);
  const [whole, parts] = [await page.evaluate(() => window.found(false)), await page.evaluate(() => window.found(true))];
  console.log({ whole, parts });
  // Upper and lower half, of the renderer that draws seldom and of the other.
  const right = { ofTexture: ['new new', 'new new'], ofAttribute: ['new new', 'new new'] };
  assert.deepEqual(whole, right);
  assert.notDeepEqual(parts, right, 'it is mended');
} finally {
  await browser.close();
}
JS
node "$work/run.mjs"
