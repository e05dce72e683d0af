// Checks the extension of silmap assets against docs/SILMAP_silhouette_map.schema.json.
//
//     npm ci && node schema.js FILE.glb …
//
// Nothing may be in the extension that the schema does not name. Then every field is taken out, made a wrong type or given an unknown
// neighbour, and the schema must refuse what it is to refuse. Exit codes: 0 all as it must be, 1 not, 2 no file was given.
"use strict";

const fs = require("node:fs");
const path = require("node:path");
const Ajv = require("ajv/dist/2020");

const NAME = "SILMAP_silhouette_map";
const SCHEMA = path.join(__dirname, "../../docs", `${NAME}.schema.json`);

/** The schema with nothing allowed that it does not name, for what silmap itself writes. */
function strict(schema) {
  if (Array.isArray(schema)) return schema.map(strict);
  if (schema === null || typeof schema !== "object") return schema;
  const copy = Object.fromEntries(Object.entries(schema).map(([key, value]) => [key, key === "allOf" ? value : strict(value)]));
  return schema.type === "object" ? { ...copy, additionalProperties: false } : copy;
}

function extensionOf(file) {
  const bytes = fs.readFileSync(file);
  const length = bytes.readUInt32LE(12);
  return JSON.parse(bytes.subarray(20, 20 + length)).extensions[NAME];
}

/** Every object below a value with the path to it, but for what is opaque. */
function* objects(value, at = []) {
  if (Array.isArray(value) || value === null || typeof value !== "object") return;
  yield at;
  for (const [key, inner] of Object.entries(value)) if (key !== "params") yield* objects(inner, [...at, key]);
}

/** Calls `change` with a copy of the object at a path, inside a copy of the whole. */
function changed(extension, at, change) {
  const copy = structuredClone(extension);
  change(at.reduce((value, key) => value[key], copy));
  return copy;
}

const OPTIONAL = new Set([
  "model.origin", "build.params", "build.uniformCurveView", "build.collapseOrderView", "map.levelsView", "map.photographed",
  "textures.atlas", "textures.atlas.normals", "textures.depthsView",
]);

/** What the schema takes and must not, or refuses and must not. */
function* faults(extension, isValid, isValidStrictly) {
  if (!isValidStrictly(extension)) yield `the schema refuses it: ${JSON.stringify(isValidStrictly.errors.slice(0, 3))}`;
  if (isValid({ ...extension, formatVersion: 4 })) yield "a later version is taken";
  if (isValid({ ...extension, checksum: "0123456G" })) yield "a checksum that is none is taken";
  for (const at of objects(extension)) {
    const unknown = changed(extension, at, (object) => (object.laterField = 1));
    if (!isValid(unknown)) yield `${at}: a field of later is refused`;
    if (isValidStrictly(unknown)) yield `${at}: a field that is not in the schema is taken`;
    for (const key of Object.keys(at.reduce((value, step) => value[step], extension))) {
      const place = [...at, key].join(".");
      const without = isValid(changed(extension, at, (object) => delete object[key]));
      if (without !== OPTIONAL.has(place)) yield `${place}: ${without ? "may" : "must not"} be missing`;
      const wrong = changed(extension, at, (object) => (object[key] = [{}]));
      if (place !== "build.params" && isValid(wrong)) yield `${place}: a wrong type is taken`;
      if (/(View|Accessor)$/.test(key) && isValid(changed(extension, at, (object) => (object[key] = -1)))) yield `${place}: −1 is taken`;
    }
  }
}

function main(files) {
  if (files.length === 0) {
    console.error("usage: node schema.js FILE.glb …");
    return 2;
  }
  const schema = JSON.parse(fs.readFileSync(SCHEMA, "utf8"));
  const ajv = new Ajv({ strictTypes: false, allErrors: true });
  const isValid = ajv.compile(schema);
  const isValidStrictly = ajv.compile(strict(schema));
  let isClean = true;
  for (const file of files) {
    const found = [...faults(extensionOf(file), isValid, isValidStrictly)];
    console.log(`${file}: ${found.length} faults by the schema of ${NAME}`);
    for (const fault of found) console.log(`  ${fault}`);
    isClean &&= found.length === 0;
  }
  return isClean ? 0 : 1;
}

process.exitCode = main(process.argv.slice(2));
