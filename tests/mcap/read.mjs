// Checks what @mcap/core reads from an exported file:  read.mjs MODULES WORK   with push.mcap, push/ and push.csv in WORK
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { resolve } from "node:path";
import zlib from "node:zlib";

const [modules, work] = process.argv.slice(2);
const { McapIndexedReader, McapStreamReader } = createRequire(resolve(modules) + "/")("@mcap/core");
const bytes = readFileSync(work + "/push.mcap");
const read = async (offset, length) => bytes.subarray(Number(offset), Number(offset + length));
const reader = await McapIndexedReader.Initialize({ readable: { size: async () => BigInt(bytes.length), read } });

const [names, ...lines] = readFileSync(work + "/push.csv", "utf8").trim().split("\n");
const columns = names.split(",");
const ticks = lines.map((line) => Object.fromEntries(line.split(",").map((value, i) => [columns[i], Number(value)])));
assert.equal(ticks.length, 1000);

// Statistics and indexes are those of the messages.
const topics = ["device_pose", "tool_pose", "wrench", "contact"];
const channels = [0, 1].flatMap((demo) => topics.map((topic) => `/demo_${demo}/${topic}`));
assert.deepEqual([...reader.channelsById.values()].map((channel) => channel.topic), channels);
assert.equal(reader.statistics.messageCount, 8000n);
assert.deepEqual([...reader.statistics.channelMessageCounts.values()], Array(8).fill(1000n));
assert.equal(reader.statistics.chunkCount, reader.chunkIndexes.length);
for (const schema of reader.schemasById.values()) JSON.parse(new TextDecoder().decode(schema.data));

// Every message in order, by the indexes: the values of the ticks, lengths in m and torques in N·m.
const seen = new Map(channels.map((topic) => [topic, 0]));
for await (const message of reader.readMessages({ validateCrcs: true })) {
  const { topic, schemaId } = reader.channelsById.get(message.channelId);
  const tick = ticks[seen.get(topic)];
  assert.equal(message.sequence, seen.get(topic));
  seen.set(topic, message.sequence + 1);
  const value = JSON.parse(new TextDecoder().decode(message.data));
  assert.equal(BigInt(value.timestamp.sec) * 1000000000n + BigInt(value.timestamp.nsec), message.logTime);
  const kind = topic.split("/")[2];
  if (kind.endsWith("_pose")) {
    assert.equal(reader.schemasById.get(schemaId).name, "foxglove.PoseInFrame");
    const part = kind.split("_")[0];
    for (const axis of "xyz") assert.equal(value.pose.position[axis], tick[`${part}_${axis}_mm`] / 1000);
    for (const axis of "wxyz") assert.equal(value.pose.orientation[axis], tick[`${part}_q${axis}`]);
  } else if (kind === "wrench") {
    for (const axis of "xyz") {
      assert.equal(value.force[axis], tick[`force_o_${axis}_N`]);
      assert.equal(value.torque[axis], tick[`torque_o_${axis}_mNm`] / 1000);
    }
  } else {
    assert.equal(value.rows, tick.rows);
  }
}
assert.deepEqual([...seen.values()], Array(8).fill(1000));
assert(ticks.some((tick) => tick.rows > 0));

// The attachments are the recording and its scene.
const attachments = new Map();
for await (const attachment of reader.readAttachments({ validateCrcs: true }))
  attachments.set(attachment.name, Buffer.from(attachment.data));
for (const demo of [0, 1]) {
  assert(attachments.get(`data/demo_${demo}/ticks.npy`).equals(readFileSync(work + "/push/ticks.npy")));
  assert(attachments.get(`data/demo_${demo}/recording.json`).equals(readFileSync(work + "/push/recording.json")));
}
const manifest = JSON.parse(attachments.get("manifest.json"));
assert.equal(manifest.demonstrations.length, 2);
assert(attachments.has(`files/${manifest.demonstrations[0].scene_hash}/hello.gltf`));
for await (const metadata of reader.readMetadata())
  assert.match(metadata.metadata.get("demo_0"), new RegExp(`1000 ticks, chain ${manifest.demonstrations[0].chain}`));

// The stream reader checks the order of all records and every checksum.
const stream = new McapStreamReader({ validateCrcs: true });
stream.append(bytes);
const counts = {};
let end;
for (let record; (record = stream.nextRecord()); ) {
  counts[record.type] = (counts[record.type] ?? 0) + 1;
  if (record.type === "DataEnd") end = record;
}
assert(stream.done());
assert.equal(counts.Message, 8000);
assert.equal(counts.MessageIndex, 4 * reader.chunkIndexes.length);
assert.equal(counts.SummaryOffset, 6);
// What the library leaves to the reader: the checksums of data section and summary.
if (zlib.crc32) {
  const footer = bytes.length - 8 - 29;
  const begin = Number(bytes.readBigUInt64LE(footer + 9));
  assert.equal(zlib.crc32(bytes.subarray(begin, footer + 25)), bytes.readUInt32LE(footer + 25));
  assert.equal(zlib.crc32(bytes.subarray(0, begin - 13)), end.dataSectionCrc);
}
