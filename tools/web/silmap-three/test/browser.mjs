// A browser without a window, for the tests.
import { existsSync } from 'node:fs';
import { delimiter, join } from 'node:path';
import { chromium } from 'playwright-core';

const BROWSERS = [process.env.CHROMIUM, 'chromium', 'chromium-browser', 'google-chrome'].filter(Boolean);
const FLAGS = [
  '--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
  '--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader', '--enable-unsafe-swiftshader', '--enable-precise-memory-info',
  '--js-flags=--expose-gc',
];

function browserPath() {
  const places = (name) => name.includes('/') ? [name] : (process.env.PATH ?? '').split(delimiter).map((p) => join(p, name));
  const found = BROWSERS.flatMap(places).find((path) => existsSync(path));
  if (!found) throw new Error('no Chromium is here: install it, or say where it is by CHROMIUM');
  return found;
}

export const openBrowser = () => chromium.launch({ executablePath: browserPath(), args: FLAGS });
