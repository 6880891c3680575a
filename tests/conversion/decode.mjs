// Decodes every message of an MCAP file with @mcap/core and protobufjs, and prints what it found.
import { McapIndexedReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";
import { FileHandleReadable } from "@mcap/nodejs";
import { open } from "node:fs/promises";
import protobuf from "protobufjs";
import "protobufjs/ext/descriptor/index.js";

const file = await open(process.argv[2], "r");
const reader = await McapIndexedReader.Initialize({
  readable: new FileHandleReadable(file),
  decompressHandlers: await loadDecompressHandlers(),
});
const types = new Map();
for (const { id, name, encoding, data } of reader.schemasById.values()) {
  if (encoding === "protobuf") {
    const root = protobuf.Root.fromDescriptor(data);
    types.set(id, root.lookupType(name));
  }
}
const found = {};
for await (const message of reader.readMessages()) {
  const { topic, schemaId } = reader.channelsById.get(message.channelId);
  const type = types.get(schemaId);
  if (type) {
    found[topic] ??= { count: 0 };
    found[topic].count += 1;
    found[topic].last = type.toObject(type.decode(message.data), { longs: Number, bytes: String });
  }
}
await file.close();
console.log(JSON.stringify(found));
