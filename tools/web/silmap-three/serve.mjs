// Serves this folder, and the files that its pages show.
//
//     npm ci && node serve.mjs ASSET.glb [MODEL.ply] [--port N]
//
// MODEL is the full mesh that the asset was made from (.ply, .obj or .glb), to compare with. Any other web server will do as well.
import { existsSync, readFileSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { dirname, extname, join, normalize, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';

export const PACKAGE = dirname(fileURLToPath(import.meta.url));
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm', '.css': 'text/css', '.json': 'application/json' };

/** Serves the package, and files by name: `{ '/asset.glb': path or bytes }`. Resolves with its address, what it sent, and `close`. */
export async function serve(files = {}, port = 0) {
  const sent = new Map();
  const server = createServer((request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
    let found = files[path] ?? join(PACKAGE, path);
    if (typeof found === 'string') {
      if (!existsSync(found) || statSync(found).isDirectory()) {
        response.writeHead(path === '/favicon.ico' ? 204 : 404).end();
        return;
      }
      response.setHeader('content-type', TYPES[extname(found)] ?? 'application/octet-stream');
      found = readFileSync(found);
    }
    sent.set(path, found.length);
    response.end(found);
  });
  await new Promise((done) => server.listen(port, '127.0.0.1', done));
  const close = () => {
    server.close();
    server.closeAllConnections();
  };
  return { address: `http://127.0.0.1:${server.address().port}`, sent, close };
}

if (process.argv[1] && resolve(process.argv[1]) === fileURLToPath(import.meta.url)) {
  const { values, positionals } = parseArgs({ allowPositionals: true, options: { port: { type: 'string' } } });
  const [asset, model] = positionals;
  if (!asset || positionals.length > 2) {
    console.error('usage: node serve.mjs ASSET.glb [MODEL.ply] [--port N]');
    process.exit(2);
  }
  const name = model && `/model${extname(model)}`;
  const { address } = await serve({ '/asset.glb': resolve(asset), ...(model && { [name]: resolve(model) }) }, Number(values.port ?? 0));
  const query = `?asset=/asset.glb${model ? `&model=${name}` : ''}`;
  for (const page of ['instances', 'compare']) console.log(`${address}/examples/${page}.html${query}`);
}
