// Runs the Khronos glTF validator on the files given and fails on any error or warning.
//
//     npm ci && node validate.js FILE.glb …
//
// Exit codes: 0 every file is clean, 1 one is not (or cannot be read), 2 no file was given.
"use strict";

const fs = require("node:fs");
const validator = require("gltf-validator");

const SEVERITIES = ["error", "warning", "information", "hint"];

async function validate(file) {
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
    uri: file,
    maxIssues: 0,
  });
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos, ${numHints} hints`);
  for (const { severity, code, message, pointer } of messages) {
    if (severity <= 1 || process.env.VERBOSE) {
      console.log(`  ${SEVERITIES[severity]} ${code} at ${pointer ?? "the file"}: ${message}`);
    }
  }
  return numErrors + numWarnings === 0;
}

async function main(files) {
  if (files.length === 0) {
    console.error("usage: node validate.js FILE.glb …");
    return 2;
  }
  let isClean = true;
  for (const file of files) {
    try {
      isClean = (await validate(file)) && isClean;
    } catch (error) {
      console.error(`${file}: ${error.message ?? error}`);
      isClean = false;
    }
  }
  return isClean ? 0 : 1;
}

main(process.argv.slice(2)).then((code) => {
  process.exitCode = code;
});
