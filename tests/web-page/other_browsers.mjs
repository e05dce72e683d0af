// Browsers that are driven without a program of their own between: Chromium by playwright, Firefox by the WebDriver BiDi that it has
// built in, WebKitGTK by its WebKitWebDriver. All have the same few functions:
//
//     name()           what the browser says it is, with its version
//     go(url)          opens a page
//     ask(given)       what a function gives that runs in the page; it may be a promise of what JSON can hold
//     picture()        the window as it is seen, a PNG
//     said()           errors of pages
//     close()
import { spawn } from 'node:child_process';
import { existsSync, mkdtempSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import WebSocket from 'ws';
import { launchOnDisplay } from './browser.mjs';

const START_MS = 60_000;

const found = (paths) => paths.flatMap((path) => path).find((path) => path && existsSync(path));

// The browsers that are here; of the others null in place of what starts them.
export function browsers() {
  const firefox = found([process.env.FIREFOX, '/usr/bin/firefox-esr', '/usr/bin/firefox']);
  const libraries = '/usr/lib';
  const folders = readdirSync(libraries).flatMap((machine) => ['webkit2gtk-4.1', 'webkitgtk-6.0'].map((kind) => join(libraries, machine, kind)));
  const webkit = found(folders.map((folder) => join(folder, 'MiniBrowser')));
  const driver = found([process.env.WEBKIT_DRIVER, '/usr/bin/WebKitWebDriver']);
  return { Chromium: startChromium, Firefox: firefox && (() => startFirefox(firefox)), WebKitGTK: webkit && driver && (() => startWebKit(driver, webkit)) };
}

async function startChromium() {
  const browser = await launchOnDisplay();
  const tab = await browser.newPage();
  const errors = [];
  tab.on('pageerror', (error) => errors.push(error.message));
  return {
    name: async () => `Chromium ${browser.version()}`,
    go: (url) => tab.goto(url),
    ask: (given) => tab.evaluate(given),
    picture: () => tab.screenshot(),
    said: () => errors,
    close: () => browser.close(),
  };
}

// Waits for a line that a process writes to where it complains.
function lineOf(process, pattern) {
  return new Promise((resolve, reject) => {
    let said = '';
    const timer = setTimeout(() => reject(new Error(`it does not start: ${said}`)), START_MS);
    process.stderr.on('data', (text) => {
      said += text;
      const line = said.match(pattern);
      if (line) {
        clearTimeout(timer);
        resolve(line);
      }
    });
    process.on('exit', () => reject(new Error(said)));
  });
}

async function startFirefox(path) {
  const profile = mkdtempSync(join(tmpdir(), 'silmap-firefox-'));
  const settings = { 'app.update.enabled': false, 'browser.shell.checkDefaultBrowser': false, 'datareporting.policy.dataSubmissionEnabled': false,
    'browser.aboutwelcome.enabled': false, 'toolkit.telemetry.enabled': false, 'webgl.force-enabled': true };
  const lines = Object.entries(settings).map(([key, value]) => `user_pref(${JSON.stringify(key)}, ${JSON.stringify(value)});\n`);
  writeFileSync(join(profile, 'user.js'), lines.join(''));
  const args = ['--no-remote', '--profile', profile, '--remote-debugging-port', '0', '--width', '900', '--height', '800', 'about:blank'];
  const browser = spawn(path, args, { stdio: ['ignore', 'ignore', 'pipe'] });
  const [, address] = await lineOf(browser, /BiDi listening on (ws:\S+)/);
  const socket = new WebSocket(`${address}/session`);
  await new Promise((resolve, reject) => socket.on('open', resolve).on('error', reject));
  const [waiting, errors] = [new Map(), []];
  socket.on('message', (text) => {
    const message = JSON.parse(text);
    if (message.method === 'log.entryAdded' && message.params.type === 'javascript') errors.push(message.params.text);
    const answer = waiting.get(message.id);
    waiting.delete(message.id);
    if (message.type === 'error') answer?.reject(new Error(message.message));
    else answer?.resolve(message.result);
  });
  let count = 0;
  const send = (method, params) => new Promise((resolve, reject) => {
    count += 1;
    waiting.set(count, { resolve, reject });
    socket.send(JSON.stringify({ id: count, method, params }));
  });
  const { capabilities } = await send('session.new', { capabilities: {} });
  await send('session.subscribe', { events: ['log.entryAdded'] });
  const { contexts } = await send('browsingContext.getTree', {});
  const { context } = contexts[0];
  return {
    name: async () => `Firefox ${capabilities.browserVersion}`,
    go: (url) => send('browsingContext.navigate', { context, url, wait: 'complete' }),
    ask: async (given) => {
      const expression = `Promise.resolve((${given})()).then((found) => JSON.stringify(found) ?? 'null')`;
      const answer = await send('script.evaluate', { expression, target: { context }, awaitPromise: true });
      if (answer.type === 'exception') throw new Error(answer.exceptionDetails.text);
      return JSON.parse(answer.result.value);
    },
    picture: async () => Buffer.from((await send('browsingContext.captureScreenshot', { context })).data, 'base64'),
    said: () => errors,
    close: async () => {
      const ended = new Promise((resolve) => browser.on('exit', resolve));
      await send('browser.close', {});
      await ended;
      rmSync(profile, { recursive: true, force: true });
    },
  };
}

async function startWebKit(driver, binary) {
  const port = 20_000 + process.pid % 20_000;
  const server = spawn(driver, [`--port=${port}`], { stdio: ['ignore', 'ignore', 'inherit'] });
  const send = async (method, path, body) => {
    const options = { method, ...(body && { body: JSON.stringify(body), headers: { 'content-type': 'application/json' } }) };
    const answer = await (await fetch(`http://127.0.0.1:${port}${path}`, options)).json();
    if (answer.value?.error) throw new Error(answer.value.message);
    return answer.value;
  };
  for (let tries = 0; ; tries++) {
    try {
      await send('GET', '/status');
      break;
    } catch (error) {
      if (tries > 100) throw error;
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
  }
  const asked = { 'webkitgtk:browserOptions': { binary, args: ['--automation'] } };
  const { sessionId, capabilities } = await send('POST', '/session', { capabilities: { alwaysMatch: asked } });
  const session = `/session/${sessionId}`;
  return {
    name: async () => `WebKitGTK ${capabilities.browserVersion}`,
    go: (url) => send('POST', `${session}/url`, { url }),
    ask: async (given) => {
      const script = `const done = arguments[0];
        Promise.resolve().then(${given}).then((found) => done(JSON.stringify({ found })), (error) => done(JSON.stringify({ error: \`\${error}\` })));`;
      const { found: value, error } = JSON.parse(await send('POST', `${session}/execute/async`, { script, args: [] }));
      if (error) throw new Error(error);
      return value;
    },
    picture: async () => Buffer.from(await send('GET', `${session}/screenshot`), 'base64'),
    // The driver does not tell.
    said: () => [],
    close: async () => {
      await send('DELETE', session);
      server.kill();
    },
  };
}
