// Makes outlines beside the page's own thread.
import init, { OutlineMaker } from '../dist/silmap_outlines.js';

const REQUEST = 6;
/** Outlines that are sent together. */
const TOGETHER = 8;

const makers = new Map();
let memory;

const answers = {
  async start({ module }) {
    memory = (await init({ module_or_path: module })).memory;
    return {};
  },
  read({ ask, file, names, files, allowedPx }) {
    const maker = new OutlineMaker(file, names, files, allowedPx);
    makers.set(ask, maker);
    return { sphere: maker.sphere() };
  },
  make({ asset, requests }) {
    const maker = makers.get(asset);
    for (let at = 0; maker && at < requests.length;) {
      const made = [];
      for (; at < requests.length && made.length < TOGETHER; at += REQUEST) {
        made.push({ name: requests[at + REQUEST - 1], texels: maker.make(requests.subarray(at, at + REQUEST - 1)) });
      }
      postMessage({ asset, made }, made.map(({ texels }) => texels.buffer));
    }
  },
  forget({ asset }) {
    makers.get(asset)?.free();
    makers.delete(asset);
  },
  memory: () => ({ bytes: memory.buffer.byteLength }),
};

onmessage = async ({ data }) => {
  const { kind, ask } = data;
  try {
    const answer = await answers[kind](data);
    if (ask !== undefined) postMessage({ ask, ...answer });
  } catch (error) {
    postMessage({ ask, error: error.message });
  }
};
