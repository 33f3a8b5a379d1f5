// Parts of the DOM that TypeScript 4.8, which Debian 12 has, doesn't know.
declare class DecompressionStream {
  constructor(format: "deflate-raw");
  readonly readable: ReadableStream<Uint8Array>;
  readonly writable: WritableStream<Uint8Array>;
}
