// Starts the viewer by what the browser can do: WebGPU, or else WebGL2. The address says what is shown:
//
//     ?asset=organic.glb&eye=1,0.5,2       an asset, and a view as the viewer's "Copy a link to this view" gives it
//     &bare                                the picture alone, without a bar and controls
//     &poster=organic.webp                 a picture that is shown until the first frame
//     &backend=webgl2                      the other way, to try it
//
// A page that embeds this one gets at the viewer by `(await frame.contentWindow.silmap).viewer`.
const parameters = new URLSearchParams(location.search);
const message = document.getElementById('message');
// In another page the picture takes the keys when it is asked to, and shows that it has them.
const isEmbedded = window !== window.top;
document.documentElement.classList.toggle('embedded', isEmbedded);
const say = (text) => { message.textContent = text; };
// What the canvas says is read out too.
const speak = (id, text) => {
  const place = document.getElementById(id);
  if (place.textContent !== text) place.textContent = text;
};

const asked = parameters.get('backend');
const poster = parameters.get('poster');
for (const own of ['backend', 'poster']) parameters.delete(own);
if (poster) {
  const still = document.getElementById('still');
  still.onload = () => { still.hidden = false; };
  still.src = poster;
}

async function hasWebGpu() {
  try {
    return Boolean(await navigator.gpu?.requestAdapter());
  } catch {
    return false;
  }
}

function hasWebGl2() {
  const context = document.createElement('canvas').getContext('webgl2');
  context?.getExtension('WEBGL_lose_context')?.loseContext();
  return Boolean(context);
}

async function backends() {
  if (asked) return [asked];
  const found = [];
  if (await hasWebGpu()) found.push('webgpu');
  if (hasWebGl2()) found.push('webgl2');
  return found;
}

// A canvas that has had a context of one kind gives none of another, and none after it was lost.
function freshCanvas() {
  const canvas = document.getElementById('picture');
  const fresh = canvas.cloneNode();
  canvas.replaceWith(fresh);
  return fresh;
}

// What draws takes the focus when it starts, and gives none back to a page around: there it gets none.
async function withoutFocus(start) {
  const { focus } = HTMLElement.prototype;
  HTMLElement.prototype.focus = () => {};
  try {
    return await start();
  } finally {
    HTMLElement.prototype.focus = focus;
  }
}

async function start(query, without) {
  const choices = (await backends()).filter((backend) => asked || backend !== without);
  if (choices.length === 0) throw new Error('this browser offers neither WebGPU nor WebGL2, and one of them is needed');
  let reason;
  for (const backend of choices) {
    if (!['webgpu', 'webgl2'].includes(backend)) throw new Error('backend is webgpu or webgl2');
    try {
      // What drew by a device that is lost is not to be used again.
      const { default: init, Viewer } = await import(`./${backend}/silmap-viewer.js?${window.restarts}`);
      await init();
      const canvas = freshCanvas();
      const viewer = await (isEmbedded ? withoutFocus(() => Viewer.start(canvas, query)) : Viewer.start(canvas, query));
      // Of the fields of the page only the picture is one to come to.
      for (const field of document.querySelectorAll('#stage input')) field.tabIndex = -1;
      current = viewer;
      watch(viewer, backend);
      return { viewer, backend };
    } catch (error) {
      reason = error;
    }
  }
  throw reason;
}

// Until there is a picture the page says what goes on; then the viewer does. A lost device is taken in place by another.
function watch(viewer, backend) {
  const since = Date.now();
  const hasAsset = parameters.has('asset');
  if (!hasAsset) say('');
  const look = () => {
    if (viewer !== current) return;
    if (viewer.is_lost()) {
      restart(viewer, Date.now() - since < SOON_MS ? backend : undefined);
      return;
    }
    if (viewer.shown() || viewer.message() || !hasAsset) {
      document.getElementById('poster').hidden = true;
      say('');
      link = viewer.link();
    }
    speak('told', viewer.described());
    speak('alert', viewer.message() ?? '');
    setTimeout(look, 250);
  };
  look();
}

// A device that is lost so soon is lost again.
const SOON_MS = 5000;
const MOST_RESTARTS = 5;
// The viewer that draws now, and what was seen last.
let current;
let link = '';
window.restarts = 0;

// Goes on with another viewer where a lost device left off, and `without` a way of drawing where that is of no use.
function restart(viewer, without) {
  if (viewer !== current) return;
  current = undefined;
  window.restarts += 1;
  if (window.restarts > MOST_RESTARTS) {
    say('The graphics device is lost again and again: reload the page to try once more.');
    return;
  }
  const query = new URLSearchParams(link || parameters);
  for (const own of ['asset', 'bare']) if (parameters.has(own)) query.set(own, parameters.get(own));
  try {
    viewer.destroy();
  } catch {
    // What is lost need not be freed.
  }
  begin(query.toString(), without);
}

// Resolves with the viewer and what it draws by; the page says what goes wrong.
function begin(query, without) {
  window.silmap = start(query, without);
  window.silmap.catch((error) => {
    message.setAttribute('role', 'alert');
    say(`${error?.message ?? error}`);
  });
}

say(parameters.has('asset') ? 'Loading' : '');
begin(parameters.toString());
// In the picture Tab goes from control to control: Escape gives the keys back to the page around.
document.addEventListener('keydown', (event) => {
  if (isEmbedded && event.key === 'Escape') document.activeElement?.blur();
}, true);
document.addEventListener('webglcontextlost', (event) => {
  event.preventDefault();
  window.silmap?.then(({ viewer }) => restart(viewer));
}, true);
