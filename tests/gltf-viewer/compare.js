// Draws an asset with three.js in a headless browser and compares the picture with silmap's own.
//
//     npm ci && node compare.js ASSET.glb OURS.png --eye X,Y,Z --target X,Y,Z --fov DEGREES [--lit] [--at-most MEAN] [--picture OUT.png]
//
// OURS.png has a transparent background and hard edges. Without --lit it is the asset's atlas (`render --mode textured --paint
// tiles`), which any viewer should show alike. With --lit it is the full mesh (`--mode original`): the hull is lit in the browser by the
// studio light and the asset's normals. The same with a mistake (an eye turned by a few degrees; no normals) must be
// farther off than the limit: a comparison that lets everything pass is worth nothing.
//
// Exit codes: 0 the pictures agree, 1 they do not (or none could be drawn), 2 usage.
"use strict";

const fs = require("node:fs");
const http = require("node:http");
const os = require("node:os");
const path = require("node:path");
const { spawn } = require("node:child_process");
const { parseArgs } = require("node:util");

// Limits of the mean difference of any channel, in steps of 255. Samplers and blending units round differently by one step.
const AT_MOST = 1.0;
// Share of pixels that only one of the pictures covers: both draw the same triangles, or with --lit a hull and the model in it.
const ONE_SIDED_AT_MOST = { plain: 0.005, lit: 0.15 };
const WRONG_TURN_DEGREES = 5;
const TIMEOUT_MS = 120_000;
const BROWSERS = [process.env.CHROMIUM, "chromium", "chromium-browser", "google-chrome"].filter(Boolean);
const FLAGS = [
  "--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run",
  "--disable-background-networking", "--disable-component-update", "--disable-sync",
];

function usage(message) {
  console.error(message);
  console.error("usage: node compare.js ASSET.glb OURS.png --eye X,Y,Z --target X,Y,Z --fov DEGREES [--lit] [--at-most MEAN] [--picture OUT.png]");
  process.exit(2);
}

function readOptions() {
  const text = { type: "string" };
  const options = { eye: text, target: text, fov: text, lit: { type: "boolean" }, "at-most": text, picture: text };
  let parsed;
  try {
    parsed = parseArgs({ options, allowPositionals: true });
  } catch (error) {
    usage(error.message);
  }
  const { values, positionals } = parsed;
  const point = (name) => {
    const numbers = (values[name] ?? "").split(",").map(Number);
    if (numbers.length !== 3 || !numbers.every(Number.isFinite)) usage(`--${name} needs three numbers`);
    return numbers;
  };
  const number = (name, otherwise) => {
    const value = values[name] === undefined ? otherwise : Number(values[name]);
    if (!(value > 0)) usage(`--${name} needs a number`);
    return value;
  };
  if (positionals.length !== 2) usage("an asset and a picture are needed");
  const [asset, ours] = positionals;
  return {
    asset, ours, picture: values.picture, eye: point("eye"), target: point("target"), fov: number("fov"),
    lit: values.lit ?? false, atMost: number("at-most", AT_MOST), wrongTurn: (WRONG_TURN_DEGREES * Math.PI) / 180,
  };
}

// The folder of three.js, the two files and the page; `onResult` gets what the page posts.
function serve(options, onResult) {
  const three = path.join(__dirname, "node_modules", "three");
  const files = { "/": path.join(__dirname, "page.html"), "/asset.glb": options.asset, "/ours.png": options.ours };
  const types = { ".html": "text/html", ".js": "text/javascript", ".png": "image/png" };
  return http.createServer((request, response) => {
    const { pathname } = new URL(request.url, "http://localhost");
    if (pathname === "/result") {
      const parts = [];
      request.on("data", (part) => parts.push(part));
      request.on("end", () => {
        response.end();
        onResult(JSON.parse(Buffer.concat(parts).toString()));
      });
      return;
    }
    if (pathname === "/options.json") {
      response.end(JSON.stringify(options));
      return;
    }
    const below = path.normalize(pathname).replace(/^\/three\//, "");
    const file = files[pathname] ?? (pathname.startsWith("/three/") ? path.join(three, below) : undefined);
    if (!file || !fs.existsSync(file)) {
      response.writeHead(404).end();
      return;
    }
    response.setHeader("content-type", types[path.extname(file)] ?? "application/octet-stream");
    response.end(fs.readFileSync(file));
  });
}

function startBrowser(url, profile) {
  const [browser] = BROWSERS.filter((name) =>
    name.includes("/") ? fs.existsSync(name) : (process.env.PATH ?? "").split(":").some((p) => fs.existsSync(path.join(p, name))));
  if (!browser) throw new Error("no Chromium is here: install it, or say where it is by CHROMIUM");
  return spawn(browser, [...FLAGS, `--user-data-dir=${profile}`, url], { stdio: "ignore", detached: true });
}

async function drawnInBrowser(options) {
  const profile = fs.mkdtempSync(path.join(os.tmpdir(), "silmap-viewer-"));
  let browser, server;
  try {
    return await new Promise((resolve, reject) => {
      setTimeout(() => reject(new Error(`the browser said nothing for ${TIMEOUT_MS / 1000} s`)), TIMEOUT_MS).unref();
      server = serve(options, resolve);
      server.listen(0, "127.0.0.1", () => {
        try {
          browser = startBrowser(`http://127.0.0.1:${server.address().port}/`, profile);
          browser.on("error", reject);
          browser.on("exit", (code) => reject(new Error(`the browser ended with ${code}`)));
        } catch (error) {
          reject(error);
        }
      });
    });
  } finally {
    if (browser && browser.exitCode === null) {
      const ended = new Promise((resolve) => browser.once("exit", resolve));
      // With its children, which would go on writing to the profile.
      process.kill(-browser.pid);
      await ended;
    }
    server?.close();
    server?.closeAllConnections();
    fs.rmSync(profile, { recursive: true, force: true, maxRetries: 20, retryDelay: 100 });
  }
}

async function main() {
  const options = readOptions();
  for (const file of [options.asset, options.ours]) {
    if (!fs.existsSync(file)) usage(`${file}: there is no such file`);
  }
  const found = await drawnInBrowser(options);
  if (found.error) throw new Error(found.error);
  if (options.picture) fs.writeFileSync(options.picture, Buffer.from(found.picture.split(",")[1], "base64"));
  const largest = (difference) => Math.max(...difference.mean);
  const { right, wrong } = found;
  const limit = options.lit ? ONE_SIDED_AT_MOST.lit : ONE_SIDED_AT_MOST.plain;
  console.log(
    `${options.asset} by ${found.renderer}: colours differ by ${largest(right).toFixed(3)} of 255 over ${right.pixels} pixels (at most ` +
      `${options.atMost}), ${(100 * right.one_sided).toFixed(2)} % of the pixels in one picture only; with a mistake by ${largest(wrong).toFixed(3)}`);
  if (!(right.pixels > 1000)) throw new Error("hardly anything is drawn");
  if (!(largest(right) <= options.atMost && right.one_sided <= limit)) throw new Error("the pictures differ");
  if (!(largest(wrong) > options.atMost)) throw new Error("a mistake goes unnoticed");
}

main().catch((error) => {
  console.error(error.message);
  process.exitCode = 1;
});
