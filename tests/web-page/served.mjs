// Whether addresses of pages answer, and the files that they name by `asset=` and `model=`.
//
//     node served.mjs ADDRESS...
//
// Exit codes: 0 they do, 1 one does not.
for (const address of process.argv.slice(2)) {
  const { searchParams } = new URL(address);
  const files = ['asset', 'model'].flatMap((key) => searchParams.getAll(key)).map((file) => new URL(file, address).href);
  for (const url of [address, ...files]) {
    const answer = await fetch(url);
    if (!answer.ok || (await answer.arrayBuffer()).byteLength === 0) throw new Error(`${url}: ${answer.status} ${answer.statusText}`);
    console.log(`${url} answers`);
  }
}
