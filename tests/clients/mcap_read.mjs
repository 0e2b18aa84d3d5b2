// Reads logs with nothing but npm's libraries, every entry decoded: `node mcap_read.mjs LOG...`.
// By the index where there is one; prints, as JSON, for each log the entries of each topic and the last value of each.
import { open } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers, protobufFromBinaryDescriptor } from "@mcap/support";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";

const decompressHandlers = await loadDecompressHandlers();

async function* indexed(file) {
  const { size } = await file.stat();
  const readable = {
    size: async () => BigInt(size),
    read: async (offset, length) => {
      const buffer = new Uint8Array(Number(length));
      await file.read({ buffer, position: Number(offset) });
      return buffer;
    },
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  if (!reader.chunkIndexes.length) throw new Error("no index");
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId);
    yield [channel, reader.schemasById.get(channel.schemaId), message];
  }
}

async function* streamed(file) {
  const reader = new McapStreamReader({ decompressHandlers });
  const { buffer, bytesRead } = await file.read({ buffer: new Uint8Array((await file.stat()).size), position: 0 });
  reader.append(buffer.subarray(0, bytesRead));
  const channels = new Map(), schemas = new Map();
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Schema") schemas.set(record.id, record);
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type === "Message") {
      const channel = channels.get(record.channelId);
      yield [channel, schemas.get(channel.schemaId), record];
    }
  }
  if (!reader.done()) throw new Error("it is not whole");
}

function decoder(channel, schema) {
  if (channel.messageEncoding === "protobuf" && schema.encoding === "protobuf") {
    const type = protobufFromBinaryDescriptor(schema.data).lookupType(schema.name);
    return (data) => type.toObject(type.decode(data), { longs: Number, bytes: String, defaults: true });
  }
  if (channel.messageEncoding === "cdr" && schema.encoding === "ros2msg") {
    const reader = new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true }));
    return (data) => reader.readMessage(data);
  }
  throw new Error(`${channel.topic} is of ${channel.messageEncoding} and ${schema.encoding}`);
}

const found = {};
for (const path of process.argv.slice(2)) {
  const file = await open(path);
  const topics = (found[path] = {});
  const decoders = new Map();
  const read = path.includes("slim") ? streamed : indexed;
  for await (const [channel, schema, message] of read(file)) {
    if (!decoders.has(channel.id)) decoders.set(channel.id, decoder(channel, schema));
    const value = decoders.get(channel.id)(message.data);
    const topic = (topics[channel.topic] ??= { entries: 0 });
    topic.entries += 1;
    topic.last = value;
  }
  await file.close();
}
console.log(JSON.stringify(found, (_, value) =>
  typeof value === "bigint" ? Number(value) : ArrayBuffer.isView(value) ? Array.from(value) : value));
