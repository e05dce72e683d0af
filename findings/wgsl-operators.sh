#!/usr/bin/env bash
# wgpu's shader compiler takes WGSL that browsers refuse. Seen with wgpu 0.32.0 (PyPI; wgpu-native, naga) and webgpu 0.6.2 (npm; Dawn,
# Tint) on x86-64 Linux. WGSL has no precedence between some operators: `a | b << 2u` needs parentheses, and so do `a & b + 1u`,
# `a ^ b | 1u`, `a << b << 1u`, `a == b == true` and `a < b == true` (WGSL, "Operator Precedence and Associativity"). naga accepts all
# six without a word, so that a shader which was tested natively, and by WebGL2 in a browser, fails by WebGPU in the same browser.
# Both are asked for the form with parentheses too, which both take.
#
# A Vulkan driver is needed (mesa-vulkan-drivers will do); Dawn runs without one. Exit code 1 when this changes.
set -euo pipefail

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-$work}
python3 -m venv "$work/python"
"$work/python/bin/pip" install --quiet --disable-pip-version-check wgpu==0.32.0
npm install --silent --no-audit --no-fund --prefix "$work" webgpu@0.6.2

cat >"$work/expressions.json" <<'JSON'
["a | (b << 2u)", "a | b << 2u", "a & b + 1u", "a ^ b | 1u", "a << b << 1u", "a == b == true", "a < b == true"]
JSON

cat >"$work/naga.py" <<'PYTHON'
import json
import sys

import wgpu

device = wgpu.gpu.request_adapter_sync().request_device_sync()
for expression in json.load(open(sys.argv[1])):
    code = "@compute @workgroup_size(1) fn main() { var a = 1u; var b = 2u; let c = %s; }" % expression
    try:
        device.create_shader_module(code=code)
        print(f"{expression}: taken")
    except wgpu.GPUError:
        print(f"{expression}: refused")
PYTHON

cat >"$work/tint.mjs" <<'JS'
import { readFileSync } from 'node:fs';
import { create, globals } from 'webgpu';

Object.assign(globalThis, globals);
const adapter = await create(['backend=null']).requestAdapter();
const device = await adapter.requestDevice();
for (const expression of JSON.parse(readFileSync(process.argv[2]))) {
  const code = `@compute @workgroup_size(1) fn main() { var a = 1u; var b = 2u; let c = ${expression}; }`;
  device.pushErrorScope('validation');
  device.createShaderModule({ code });
  console.log(`${expression}: ${(await device.popErrorScope()) ? 'refused' : 'taken'}`);
}
process.exit(0);
JS

python=$("$work/python/bin/python" "$work/naga.py" "$work/expressions.json" 2>/dev/null)
node=$(node "$work/tint.mjs" "$work/expressions.json" 2>/dev/null)
printf 'wgpu 0.32.0\n%s\n\nwebgpu 0.6.2\n%s\n' "$python" "$node"
[ "$(grep -c ': taken$' <<<"$python")" = 7 ]
[ "$(grep -c ': refused$' <<<"$node")" = 6 ]
grep -qF 'a | (b << 2u): taken' <<<"$node"
