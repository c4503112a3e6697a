// A foreign client, tus-js-client, uploads a file in parts, aborts half-way, finds its upload again and finishes it.
// node tus_upload.mjs ENDPOINT FILE CHUNK_BYTES METADATA_JSON
import fs from 'node:fs';
import * as tus from 'tus-js-client';

const [endpoint, path, chunk, metadata] = process.argv.slice(2);
const size = fs.statSync(path).size;

function run(extra, untilOffset) {
  return new Promise((resolve, reject) => {
    const upload = new tus.Upload(fs.createReadStream(path), {
      endpoint,
      chunkSize: Number(chunk),
      uploadSize: size,
      metadata: JSON.parse(metadata),
      retryDelays: [100, 300],
      onError: reject,
      onSuccess: () => resolve(upload.url),
      onChunkComplete: async (_, accepted) => {
        if (accepted < untilOffset || accepted === size) return;
        await upload.abort();
        resolve(upload.url);
      },
      ...extra,
    });
    upload.start();
  });
}

const url = await run({}, size / 2);
const half = await fetch(url, {method: 'HEAD', headers: {'Tus-Resumable': '1.0.0'}});
const reached = Number(half.headers.get('Upload-Offset'));
await run({uploadUrl: url}, size + 1);
let refused = '';
try {
  await run({metadata: {...JSON.parse(metadata), name: 'damaged', sha256: '0'.repeat(64)}}, size + 1);
} catch (error) {
  refused = String(error.originalResponse?.getStatus());
}
await run({metadata: {...JSON.parse(metadata), name: 'at-once'}, uploadDataDuringCreation: true}, size + 1);
console.log(JSON.stringify({url, reached, refused}));
