// Writes glTF models with the libraries that people write them with: glTF-Transform and three.js. Run by foreign_gltf.py, in a
// folder where both are installed and `quarters.png` lies; argument: the folder to write to.
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { Document, NodeIO } from '@gltf-transform/core';
import { ALL_EXTENSIONS, KHRTextureTransform } from '@gltf-transform/extensions';
import { cloneDocument, draco, instance, meshopt, quantize, sparse, unweld } from '@gltf-transform/functions';
import { MeshoptDecoder, MeshoptEncoder } from 'meshoptimizer';
import draco3d from 'draco3dgltf';
import { ktx2 } from 'ktx2-encoder/gltf-transform';
import * as THREE from 'three';
import { GLTFExporter } from 'three/addons/exporters/GLTFExporter.js';

const out = process.argv[2];
await MeshoptEncoder.ready;
const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
    'meshopt.encoder': MeshoptEncoder,
    'meshopt.decoder': MeshoptDecoder,
    'draco3d.encoder': await draco3d.createEncoderModule(),
    'draco3d.decoder': await draco3d.createDecoderModule(),
});

// The unit cube about the origin, each side with the whole picture, upright as seen from +z.
const SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
const corner = (i) => [i >> 2, (i >> 1) & 1, i & 1].map((b) => b - 0.5);

function cube(uv = (u, v) => [u, v]) {
    const document = new Document();
    const buffer = document.createBuffer();
    const [positions, uvs, indices] = [[], [], []];
    for (const side of SIDES) {
        const first = positions.length / 3;
        const corners = [[0, 1], [1, 1], [1, 0], [0, 0]];
        side.forEach((i, k) => (positions.push(...corner(i)), uvs.push(...uv(...corners[k]))));
        indices.push(...[0, 1, 2, 0, 2, 3].map((k) => first + k));
    }
    const accessor = (type, array) => document.createAccessor().setType(type).setArray(array).setBuffer(buffer);
    const texture = document.createTexture('quarters').setImage(readFileSync('quarters.png')).setMimeType('image/png');
    const material = document.createMaterial('skin').setBaseColorTexture(texture).setRoughnessFactor(1);
    const primitive = document.createPrimitive().setMaterial(material)
        .setAttribute('POSITION', accessor('VEC3', new Float32Array(positions)))
        .setAttribute('TEXCOORD_0', accessor('VEC2', new Float32Array(uvs)))
        .setIndices(accessor('SCALAR', new Uint16Array(indices)));
    const mesh = document.createMesh('cube').addPrimitive(primitive);
    const scene = document.createScene().addChild(document.createNode('cube').setMesh(mesh));
    document.getRoot().setDefaultScene(scene);
    return { document, mesh, scene, material, primitive };
}

const write = (name, document) => io.write(join(out, name), document);
const made = async (name, base, ...steps) => {
    const document = cloneDocument(base);
    await document.transform(...steps);
    await write(name, document);
};

const { document: base } = cube();
await write('transform-plain.glb', base);
await write('transform-plain.gltf', base);
await made('transform-quantize.glb', base, quantize());
await made('transform-quantize-scene.glb', base, quantize({ quantizationVolume: 'scene' }));
await made('transform-meshopt-medium.glb', base, meshopt({ encoder: MeshoptEncoder, level: 'medium' }));
await made('transform-meshopt-high.glb', base, meshopt({ encoder: MeshoptEncoder, level: 'high' }));
await made('transform-draco-edgebreaker.glb', base, draco({ method: 'edgebreaker' }));
await made('transform-draco-sequential.glb', base, draco({ method: 'sequential' }));
await made('transform-unweld.glb', base, unweld());

{ // The picture moved by half of it each way: the quarters change places.
    const { document, material } = cube();
    const transform = document.createExtension(KHRTextureTransform).createTransform().setOffset([0.5, 0.5]);
    material.getBaseColorTextureInfo().setExtension('KHR_texture_transform', transform);
    await write('transform-offset.glb', document);
    await made('transform-offset-meshopt.glb', document, meshopt({ encoder: MeshoptEncoder }));
}
{ // Mirrored along u, in the second period.
    const { document, material } = cube((u, v) => [u + 1, v]);
    material.getBaseColorTextureInfo().setWrapS(33648).setWrapT(33071);
    await write('transform-mirrored.glb', document);
}
{ // Seven bodies, one of them mirrored, made instances of one; and the same compressed.
    const { document, mesh, scene } = cube();
    for (let k = 1; k < 7; k++) {
        const node = document.createNode().setMesh(mesh).setTranslation([3 * k, 0, 0]);
        scene.addChild(k === 3 ? node.setScale([1, -1, 1]) : node.setRotation([0, Math.SQRT1_2, 0, Math.SQRT1_2]));
    }
    await write('transform-nodes.glb', document);
    await made('transform-instance.glb', document, instance());
    await made('transform-instance-meshopt.glb', document, instance(), meshopt({ encoder: MeshoptEncoder }));
}
{ // A morph target that doubles the cube along x, with weight; mostly zeros, so that it becomes sparse.
    const { document, mesh, primitive } = cube();
    const deltas = Array.from(primitive.getAttribute('POSITION').getArray(), (x, i) => (i % 3 === 0 && x > 0 ? 1 : 0));
    const target = document.createPrimitiveTarget().setAttribute('POSITION',
        document.createAccessor().setType('VEC3').setArray(new Float32Array(deltas)).setBuffer(document.getRoot().listBuffers()[0]));
    primitive.addTarget(target);
    mesh.setWeights([1]);
    await write('transform-morph.glb', document);
    await made('transform-morph-sparse.glb', document, sparse({ ratio: 0.9 }));
}

{ // The picture in forms for graphics cards, which are not read.
    const data = new Uint8Array(64 * 64 * 4);
    const quarter = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255, 255, 0, 255]];
    for (let i = 0; i < 64 * 64; i++) data.set(quarter[(i % 64 >= 32) + 2 * (i >= 32 * 64)], 4 * i);
    const imageDecoder = async () => ({ data, width: 64, height: 64 });
    await made('transform-ktx-uastc.glb', base, ktx2({ isUASTC: true, generateMipmap: false, imageDecoder }));
    await made('transform-ktx-etc1s.glb', base, ktx2({ isUASTC: false, generateMipmap: false, imageDecoder }));
}

// What GLTFExporter asks of a browser.
globalThis.FileReader = class {
    readAsArrayBuffer(blob) {
        blob.arrayBuffer().then((result) => ((this.result = result), this.onloadend()));
    }
    readAsDataURL(blob) {
        blob.arrayBuffer().then((bytes) => {
            this.result = `data:${blob.type || 'application/octet-stream'};base64,${Buffer.from(bytes).toString('base64')}`;
            this.onloadend();
        });
    }
};
async function three(name, object, binary = true) {
    const scene = new THREE.Scene();
    scene.add(object);
    scene.updateMatrixWorld(true);
    const result = await new GLTFExporter().parseAsync(scene, { binary, onlyVisible: true });
    writeFileSync(join(out, name), binary ? Buffer.from(result) : JSON.stringify(result));
}
const red = new THREE.MeshStandardMaterial({ color: 0xff0000 });
await three('three-box.glb', new THREE.Mesh(new THREE.BoxGeometry(), red));
await three('three-box.gltf', new THREE.Mesh(new THREE.BoxGeometry(), red), false);
{
    const group = new THREE.Group();
    const left = new THREE.Mesh(new THREE.BoxGeometry(1, 2, 3), red);
    left.position.x = -4;
    left.rotation.set(0.3, 0.4, 0.5);
    const right = left.clone();
    right.position.x = 4;
    right.scale.set(-1, 1, 1);
    group.add(left, right);
    await three('three-mirrored.glb', group);
}
{
    const geometry = new THREE.BoxGeometry();
    const colours = new Float32Array(72).fill(0).map((_, i) => (i % 3 === 1 ? 1 : 0));
    geometry.setAttribute('color', new THREE.BufferAttribute(colours, 3));
    await three('three-vertex-colours.glb', new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ vertexColors: true })));
}
{
    const many = new THREE.InstancedMesh(new THREE.BoxGeometry(), red, 5);
    for (let k = 0; k < 5; k++) {
        const matrix = new THREE.Matrix4().makeRotationY(k).premultiply(new THREE.Matrix4().makeTranslation(3 * k, 0, 0));
        many.setMatrixAt(k, matrix.scale(new THREE.Vector3(1, 1, k === 4 ? 2 : 1)));
    }
    await three('three-instanced.glb', many);
}
{
    // Four sides of a box follow one bone, which stands two above where it was bound.
    const geometry = new THREE.BoxGeometry();
    const upper = Array.from({ length: 24 }, (_, i) => geometry.attributes.position.getY(i) > 0);
    geometry.setAttribute('skinIndex', new THREE.Uint16BufferAttribute(upper.flatMap((u) => [u ? 1 : 0, 0, 0, 0]), 4));
    geometry.setAttribute('skinWeight', new THREE.Float32BufferAttribute(upper.flatMap(() => [1, 0, 0, 0]), 4));
    const mesh = new THREE.SkinnedMesh(geometry, red);
    const [root, tip] = [new THREE.Bone(), new THREE.Bone()];
    root.add(tip);
    mesh.add(root);
    mesh.updateMatrixWorld(true);
    mesh.bind(new THREE.Skeleton([root, tip]));
    tip.position.y = 2;
    const group = new THREE.Group();
    group.add(mesh);
    await three('three-skinned.glb', group);
}
