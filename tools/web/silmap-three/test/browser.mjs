// A server of this folder, and a browser: for the tests and for the pages.
import { existsSync, readFileSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { delimiter, dirname, extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

export const PACKAGE = join(dirname(fileURLToPath(import.meta.url)), '..');
const THREE = join(PACKAGE, 'node_modules/three');
const BROWSERS = [process.env.CHROMIUM, 'chromium', 'chromium-browser', 'google-chrome'].filter(Boolean);
const FLAGS = [
  '--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
  '--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader', '--enable-unsafe-swiftshader', '--enable-precise-memory-info',
  '--js-flags=--expose-gc',
];
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm', '.css': 'text/css' };

/** Serves the package, three.js under `/three/`, and files by name: `{ '/asset.glb': path or bytes }`. Resolves with its address. */
export async function serve(files = {}, port = 0) {
  const server = createServer((request, response) => {
    const path = normalize(new URL(request.url, 'http://localhost').pathname);
    let found = files[path];
    if (found === undefined) found = path.startsWith('/three/') ? join(THREE, path.slice(7)) : join(PACKAGE, path);
    if (typeof found === 'string') {
      if (existsSync(found) && statSync(found).isDirectory()) found = join(found, 'index.html');
      if (!existsSync(found)) {
        response.writeHead(path === '/favicon.ico' ? 204 : 404).end();
        return;
      }
      response.setHeader('content-type', TYPES[extname(found)] ?? 'application/octet-stream');
      found = readFileSync(found);
    }
    response.end(found);
  });
  await new Promise((resolve) => server.listen(port, '127.0.0.1', resolve));
  const close = () => {
    server.close();
    server.closeAllConnections();
  };
  return { address: `http://127.0.0.1:${server.address().port}`, close };
}

function browserPath() {
  const places = (name) => name.includes('/') ? [name] : (process.env.PATH ?? '').split(delimiter).map((p) => join(p, name));
  const found = BROWSERS.flatMap(places).find((path) => existsSync(path));
  if (!found) throw new Error('no Chromium is here: install it, or say where it is by CHROMIUM');
  return found;
}

export const openBrowser = () => chromium.launch({ executablePath: browserPath(), args: FLAGS });
