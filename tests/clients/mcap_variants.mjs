// Writes small MCAP files in every form that the format allows, with @mcap/core's record builder: `node mcap_variants.mjs FOLDER`.
// The forms are those of MCAP's conformance suite, 416 of them. Prints, as JSON, how many entries its stream reader finds in each.
import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { McapRecordBuilder, McapStreamReader } from "@mcap/core";
import { crc32 } from "@foxglove/crc";

const folder = process.argv[2];
const schema = { id: 1, name: "Example", encoding: "c", data: new Uint8Array([4, 5, 6]) };
const described = { id: 1, schemaId: 1, topic: "example", messageEncoding: "a", metadata: new Map([["foo", "bar"]]) };
const message = (time, sequence) => ({
  channelId: 1, sequence, publishTime: BigInt(time), logTime: BigInt(time), data: new Uint8Array([1, 2, 3]),
});
const attachment = { name: "myFile", logTime: 2n, createTime: 1n, mediaType: "application/octet-stream", data: new Uint8Array([1, 2, 3]) };
const metadata = { name: "myMetadata", metadata: new Map([["foo", "bar"]]) };
const contents = {
  NoData: {},
  OneMessage: { schema, channel: described, messages: [message(2, 10)] },
  OneAttachment: { attachment },
  OneMetadata: { metadata },
  OneSchemalessMessage: { channel: { ...described, schemaId: 0 }, messages: [message(2, 10)] },
  TenMessages: { schema, channel: described, messages: Array.from({ length: 10 }, (_, number) => message(number, number)) },
};

function* variants() {
  for (const [name, content] of Object.entries(contents)) {
    const sensible = ["st", "pad"];
    if (content.schema) sensible.push("rsh");
    if (content.channel) sensible.push("rch", "ch", "mx", "chx");
    if (content.attachment) sensible.push("ax");
    if (content.metadata) sensible.push("mdx");
    for (let chosen = 0; chosen < 1 << sensible.length; chosen++) {
      const features = new Set(sensible.filter((_, number) => chosen & (1 << number)));
      if ((features.has("mx") || features.has("chx")) && !features.has("ch")) continue;
      yield [name, content, features];
      if (["st", "rsh", "rch", "ax", "mdx", "chx"].some((one) => features.has(one))) {
        yield [name, content, new Set([...features, "sum"])];
      }
    }
  }
}

function inChunk(content) {
  const builder = new McapRecordBuilder();
  if (content.schema) builder.writeSchema(content.schema);
  builder.writeChannel(content.channel);
  const records = [];
  for (const one of content.messages) {
    records.push([one.logTime, BigInt(builder.length)]);
    builder.writeMessage(one);
  }
  return { data: new Uint8Array(builder.buffer), records };
}

function* span(content) {
  for (const one of content.messages ?? []) yield one.logTime;
}

function fileOf(content, features) {
  const builder = new McapRecordBuilder({ padRecords: features.has("pad") });
  const at = () => BigInt(builder.length);
  const times = [...span(content)];
  const messageStartTime = times[0] ?? 0n;
  const messageEndTime = times[times.length - 1] ?? 0n;
  const summary = [];
  builder.writeMagic();
  builder.writeHeader({ profile: "", library: "" });
  if (features.has("ch")) {
    const { data, records } = inChunk(content);
    const size = BigInt(data.byteLength);
    const chunkStartOffset = at();
    builder.writeChunk({
      messageStartTime, messageEndTime, uncompressedSize: size, uncompressedCrc: crc32(data), compression: "", records: data,
    });
    const messageIndexOffsets = new Map();
    const chunkLength = at() - chunkStartOffset;
    if (features.has("mx")) {
      messageIndexOffsets.set(1, at());
      builder.writeMessageIndex({ channelId: 1, records });
    }
    if (features.has("chx")) {
      summary.push([0x08, () => builder.writeChunkIndex({
        messageStartTime, messageEndTime, chunkStartOffset, chunkLength, messageIndexOffsets,
        messageIndexLength: index, compression: "", compressedSize: size, uncompressedSize: size,
      })]);
    }
    const index = at() - chunkStartOffset - chunkLength;
  } else {
    if (content.schema) builder.writeSchema(content.schema);
    if (content.channel) builder.writeChannel(content.channel);
    for (const one of content.messages ?? []) builder.writeMessage(one);
  }
  if (content.attachment) {
    const offset = at();
    const length = builder.writeAttachment(content.attachment);
    const { data, ...rest } = content.attachment;
    const dataSize = BigInt(data.byteLength);
    if (features.has("ax")) summary.push([0x0a, () => builder.writeAttachmentIndex({ ...rest, offset, length, dataSize })]);
  }
  if (content.metadata) {
    const offset = at();
    const length = builder.writeMetadata(content.metadata);
    const name = content.metadata.name;
    if (features.has("mdx")) summary.push([0x0d, () => builder.writeMetadataIndex({ offset, length, name })]);
  }
  builder.writeDataEnd({ dataSectionCrc: 0 });
  if (features.has("rsh")) summary.push([0x03, () => builder.writeSchema(content.schema)]);
  if (features.has("rch")) summary.push([0x04, () => builder.writeChannel(content.channel)]);
  if (features.has("st")) {
    summary.push([0x0b, () => builder.writeStatistics({
      messageCount: BigInt(times.length), schemaCount: content.schema ? 1 : 0, channelCount: content.channel ? 1 : 0,
      attachmentCount: content.attachment ? 1 : 0, metadataCount: content.metadata ? 1 : 0,
      chunkCount: features.has("ch") ? 1 : 0, messageStartTime, messageEndTime,
      channelMessageCounts: new Map(times.length ? [[1, BigInt(times.length)]] : []),
    })]);
  }
  const summaryStart = at();
  const groups = summary.map(([groupOpcode, write]) => {
    const groupStart = at();
    write();
    return { groupOpcode, groupStart, groupLength: at() - groupStart };
  });
  const offsets = at();
  if (features.has("sum")) groups.forEach((group) => builder.writeSummaryOffset(group));
  const end = new McapRecordBuilder();
  const footer = {
    summaryStart: summary.length ? summaryStart : 0n, summaryOffsetStart: features.has("sum") ? offsets : 0n, summaryCrc: 0,
  };
  end.writeFooter(footer);
  if (summary.length) {
    const before = Buffer.concat([builder.buffer.slice(Number(summaryStart)), end.buffer.slice(0, -4)]);
    end.reset();
    end.writeFooter({ ...footer, summaryCrc: crc32(before) });
  }
  end.writeMagic();
  return Buffer.concat([builder.buffer, end.buffer]);
}

const counts = {};
mkdirSync(folder, { recursive: true });
for (const [name, content, features] of variants()) {
  const file = `${[name, ...[...features].sort()].join("-")}.mcap`;
  const data = fileOf(content, features);
  writeFileSync(join(folder, file), data);
  const reader = new McapStreamReader();
  reader.append(data);
  counts[file] = 0;
  for (let record; (record = reader.nextRecord()); ) counts[file] += record.type === "Message" ? 1 : 0;
  if (!reader.done()) throw new Error(`${file} is not whole`);
}
console.log(JSON.stringify(counts));
