// Where Chromium is, and what it is started with so that it draws without a graphics card. This file needs no package.
import { existsSync } from 'node:fs';
import { delimiter, join } from 'node:path';

const BROWSERS = [process.env.CHROMIUM, 'chromium', 'chromium-browser', 'google-chrome'].filter(Boolean);

export const FLAGS = [
  '--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
  '--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader', '--enable-unsafe-swiftshader',
];

export function browserPath() {
  const places = (name) => name.includes('/') ? [name] : (process.env.PATH ?? '').split(delimiter).map((p) => join(p, name));
  const found = BROWSERS.flatMap(places).find((path) => existsSync(path));
  if (!found) throw new Error('no Chromium is here: install it, or say where it is by CHROMIUM');
  return found;
}
