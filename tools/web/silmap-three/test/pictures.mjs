// How a picture in the browser differs from ours: at boundaries, and inside.

/** Steps of 255 that a channel may be off inside. */
export const STEPS = 2;
/** From one pixel to the next so many steps are an edge: of the outline, or of one part of the hull before another. */
const EDGE_STEPS = 12;

const CHANNELS = [0, 1, 2, 3];

/**
 * Compares two square pictures of RGBA. A pixel is `off` where a channel differs by more than `STEPS`; it is excused where ours has an
 * edge beside it and one of its neighbours has what it shows. Of those that are not excused, `unexplained` are at an edge and `inside` are not.
 */
export function compare(ours, theirs, size) {
  const found = { covered: 0, edges: 0, off: 0, unexplained: 0, inside: 0, mostInside: 0 };
  const value = (picture, pixel, c) => picture[4 * pixel + c];
  for (let pixel = 0; pixel < size * size; pixel++) {
    const [x, y] = [pixel % size, Math.floor(pixel / size)];
    const columns = [x - 1, x, x + 1].filter((k) => k >= 0 && k < size);
    const rows = [y - 1, y, y + 1].filter((k) => k >= 0 && k < size);
    const around = rows.flatMap((row) => columns.map((column) => row * size + column));
    const ranges = CHANNELS.map((c) => around.map((p) => value(ours, p, c))).map((v) => [Math.min(...v), Math.max(...v)]);
    const isEdge = ranges.some(([least, most]) => most - least > EDGE_STEPS);
    const differences = CHANNELS.map((c) => Math.abs(value(ours, pixel, c) - value(theirs, pixel, c)));
    found.covered += value(ours, pixel, 3) > 0;
    found.edges += isEdge;
    if (differences.every((d) => d <= STEPS)) continue;
    found.off += 1;
    const isExplained = isEdge && ranges.every(([least, most], c) => {
      const shown = value(theirs, pixel, c);
      return shown >= least - STEPS && shown <= most + STEPS;
    });
    if (isExplained) continue;
    if (isEdge) {
      found.unexplained += 1;
    } else {
      found.inside += 1;
      found.mostInside = Math.max(found.mostInside, ...differences);
    }
  }
  return found;
}
