// What is around the picture on the viewer's page: the poster, files that are dropped, pictures that are saved, the number of views,
// the keyboard alone, and a page that embeds it. `viewer.mjs` runs all of it by each way of drawing.
//
// Each function takes the same things: a tab, the page's address and an asset's bytes, what asks (`expect`, `until`, `open`, `picture`),
// and the query of a view that it is looked at by.
import { readFileSync } from 'node:fs';
import { PNG } from 'pngjs';

// A poster, all of one colour.
const POSTER_COLOUR = [20, 160, 60, 255];

function poster() {
  const picture = new PNG({ width: 64, height: 64 });
  for (let k = 0; k < picture.data.length; k++) picture.data[k] = POSTER_COLOUR[k % 4];
  return PNG.sync.write(picture);
}

function withQuery(address, query) {
  const url = new URL(address);
  for (const [key, value] of Object.entries(query)) url.searchParams.set(key, value);
  return url.href;
}

// How many pixels differ by more than `steps` of 255.
export function differing(one, other, steps = 0) {
  if (one.length !== other.length) return Math.max(one.length, other.length) / 4;
  let count = 0;
  for (let pixel = 0; pixel < one.length; pixel += 4) {
    if ([0, 1, 2, 3].some((c) => Math.abs(one[pixel + c] - other[pixel + c]) > steps)) count += 1;
  }
  return count;
}

const shown = async (tab) => tab.evaluate(async () => (await window.silmap).viewer.shown());
const link = async (tab) => tab.evaluate(async () => (await window.silmap).viewer.link());

// A picture is there until the first frame, and no longer.
export async function posterUntilTheFirstFrame({ tab, address, look, expect, until, picture, size }) {
  let release;
  const held = new Promise((resolve) => { release = resolve; });
  await tab.route('**/asset/*', async (route) => {
    await held;
    await route.continue();
  });
  await tab.route('**/poster.png', (route) => route.fulfill({ contentType: 'image/png', body: poster() }));
  await tab.goto(withQuery(address, { ...look, bare: '', poster: 'poster.png' }));
  // The program runs, and waits for the asset.
  await until(tab, async () => (await window.silmap).viewer.picture().length > 0);
  await until(tab, () => document.getElementById('still').naturalWidth > 0);
  const middle = 4 * (size * (size / 2) + size / 2);
  const isPoster = (pixels) => POSTER_COLOUR.every((value, c) => pixels[middle + c] === value);
  expect(isPoster(await picture(tab)), 'no poster before the first frame');
  expect((await shown(tab)) === undefined, 'an asset that has not come is shown');
  release();
  await until(tab, async () => (await window.silmap).viewer.shown());
  await until(tab, () => document.getElementById('poster').hidden);
  expect(!isPoster(await picture(tab)), 'the poster is there after the first frame');
  await tab.unroute('**/asset/*');
  await tab.unroute('**/poster.png');
}

// Files that cannot be opened leave what was there, and the page says so to those who do not see it.
export async function droppedFiles({ tab, address, look, asset, expect, until, open, picture }) {
  await open(tab, address, { ...look, bare: '' });
  const before = await picture(tab);
  const name = await shown(tab);
  const newer = Buffer.from(asset.toString('latin1').replace(/"formatVersion":\d/, '"formatVersion":9'), 'latin1');
  expect(!newer.equals(asset), 'the asset says no version');
  const refused = [['broken.glb', asset.subarray(0, asset.length / 2), /./], ['notes.txt', Buffer.from('no asset'), /./],
    ['newer.glb', newer, /newer/]];
  for (const [file, bytes, says] of refused) {
    await drop(tab, file, bytes);
    const text = await until(tab, async () => (await window.silmap).viewer.message());
    expect(text.includes(file) && says.test(text), `${file}: ${text}`);
    await until(tab, async () => document.querySelector('#alert[role=alert]').textContent === (await window.silmap).viewer.message());
    expect((await shown(tab)) === name, `${file}: another is shown`);
    await tab.evaluate(async () => (await window.silmap).viewer.dismiss());
    expect(differing(before, await picture(tab)) === 0, `${file}: the picture is another`);
  }
  await drop(tab, 'again.glb', asset);
  await until(tab, async () => (await window.silmap).viewer.shown() === 'again.glb');
  // What never starts is said by the page itself.
  await tab.goto(withQuery(address, { ...look, backend: 'none' }));
  await until(tab, () => document.querySelector('#message[role=alert]')?.textContent);
}

async function drop(tab, name, bytes) {
  await tab.evaluate(({ name, text }) => {
    const data = new DataTransfer();
    data.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
    const event = new DragEvent('drop', { dataTransfer: data, bubbles: true, cancelable: true });
    document.querySelector('canvas').dispatchEvent(event);
  }, { name, text: bytes.toString('base64') });
}

// The picture as it is seen comes as a file.
export async function savedPicture({ tab, address, look, expect, open, picture, size }) {
  await open(tab, address, { ...look, bare: '' });
  const seen = await picture(tab);
  const [download] = await Promise.all([tab.waitForEvent('download'), tab.evaluate(async () => (await window.silmap).viewer.save())]);
  expect(download.suggestedFilename() === 'asset.png', `it is saved as ${download.suggestedFilename()}`);
  const saved = PNG.sync.read(readFileSync(await download.path()));
  expect(saved.width === size && saved.height === size, `it is saved with ${saved.width}×${saved.height} pixels`);
  const off = differing(seen, saved.data, 1);
  expect(off === 0, `${off} pixels of the saved picture differ from the one that is seen`);
}

// With Tab alone to what is called so; false where it is not there.
async function tabTo(tab, name, most = 40) {
  const described = () => tab.evaluate(async () => (await window.silmap).viewer.described());
  for (let k = 0; k < most; k++) {
    const before = await described();
    await tab.keyboard.press('Tab');
    for (let wait = 0; wait < 20 && (await described()) === before; wait++) await tab.waitForTimeout(50);
    if ((await described()).includes(name)) return true;
  }
  return false;
}

// Controls by the keyboard alone: fewer views, and a saved picture.
export async function keyboardAlone({ tab, address, look, expect, until, open, picture }) {
  await tab.setViewportSize({ width: 1000, height: 760 });
  await open(tab, address, look);
  const before = await picture(tab);
  await tab.evaluate(() => document.querySelector('canvas').focus());
  expect(await tabTo(tab, 'Views'), 'Tab does not lead to the number of views');
  // One after the other, and the first when frames have been drawn: until then egui takes an arrow as a step of the focus.
  await tab.waitForTimeout(1500);
  const link = () => tab.evaluate(async () => (await window.silmap).viewer.link());
  for (let k = 0; k < 40 && !(await link()).includes('keep=12'); k++) {
    const had = await link();
    await tab.keyboard.press('ArrowLeft');
    for (let wait = 0; wait < 40 && (await link()) === had; wait++) await tab.waitForTimeout(50);
  }
  expect((await link()).includes('keep=12'), 'arrows do not lead to twelve views');
  expect(differing(before, await picture(tab)) > 100, 'fewer views change nothing');
  expect(await tabTo(tab, 'Save picture'), 'Tab does not lead to the button that saves');
  await tab.waitForTimeout(1500);
  const [download] = await Promise.all([tab.waitForEvent('download'), tab.keyboard.press('Enter')]);
  expect(download.suggestedFilename() === 'asset.png', `it is saved as ${download.suggestedFilename()}`);
  const told = () => document.getElementById('told').textContent.includes('Save picture');
  await until(tab, told);
}

// By the number of views that a link says.
export async function fewerViews({ tab, address, look, expect, open, picture }) {
  await open(tab, address, { ...look, bare: '' });
  const all = await picture(tab);
  await open(tab, address, { ...look, bare: '', keep: '8' });
  const few = await picture(tab);
  const off = differing(all, few);
  expect(off > 100, `with 8 views only ${off} pixels are others`);
  await tab.evaluate(async () => { (await window.silmap).viewer.look(''); });
  expect(differing(all, await picture(tab)) === 0, 'with all views again the picture is another');
}

const HOST = (source) => `<!doctype html><title>host</title><style>body { margin: 0; height: 3000px }
  iframe { width: 360px; height: 300px; border: 20px solid #fff; display: block }</style>
  <input id="first"><iframe src="${source}" title="A model that can be turned"></iframe><input id="last">`;

// In another page it takes neither focus, wheel nor keys until it is asked to, shows that it has them, and gives them back.
export async function embedded({ tab, address, look, expect, until, size }) {
  await tab.setViewportSize({ width: size, height: size });
  await tab.route('**/host.html', (route) => {
    route.fulfill({ contentType: 'text/html', body: HOST(withQuery(address, { ...look, bare: '' }).replaceAll('&', '&amp;')) });
  });
  await tab.goto(new URL('host.html', address).href);
  await until(tab, () => document.querySelector('iframe').contentWindow.silmap);
  const inside = tab.frames().find((frame) => frame !== tab.mainFrame());
  const inFrame = { evaluate: (given) => inside.evaluate(given), waitForTimeout: (millis) => tab.waitForTimeout(millis) };
  await until(inFrame, async () => (await window.silmap).viewer.shown());
  await tab.waitForTimeout(300);
  const first = await link(inside);
  expect(await tab.evaluate(() => document.activeElement === document.body), 'it takes the focus');
  await tab.mouse.move(200, 150);
  await tab.mouse.wheel(0, 60);
  await tab.keyboard.press('ArrowLeft');
  await tab.waitForTimeout(400);
  expect(await tab.evaluate(() => scrollY) > 0, 'the wheel does not scroll the page around');
  expect((await link(inside)) === first, 'it is turned by what belongs to the page around');
  // With the keyboard from one field to the next.
  await tab.evaluate(() => { scrollTo(0, 0); document.getElementById('first').focus(); });
  await tab.keyboard.press('Tab');
  await until(inFrame, () => document.activeElement === document.querySelector('canvas'));
  const ring = await inside.evaluate(() => getComputedStyle(document.querySelector('canvas')).outlineStyle);
  expect(ring === 'solid', 'no ring is around what has the focus');
  await tab.keyboard.press('ArrowLeft');
  await tab.waitForTimeout(400);
  const turned = await link(inside);
  expect(turned !== first, 'with the focus the keys do not turn it');
  await tab.mouse.move(200, 150);
  await tab.mouse.wheel(0, 60);
  await tab.waitForTimeout(400);
  expect(await tab.evaluate(() => scrollY) === 0, 'with the focus the wheel scrolls the page around');
  expect((await link(inside)) !== turned, 'with the focus the wheel does nothing');
  await tab.keyboard.press('Escape');
  await until(inFrame, () => document.activeElement !== document.querySelector('canvas'));
  await tab.keyboard.press('Tab');
  await until(tab, () => document.activeElement.id === 'last');
  await tab.unroute('**/host.html');
}
