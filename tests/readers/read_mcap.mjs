// Lists an MCAP file with @mcap/core, as read_bag.py does a bag:
//   node read_mcap.mjs FILE        a row a topic: NAME TYPE MESSAGES CHECK NUMBER
// It reads the file from its start, checksums included, and by its indexes, where it has any; fails
// where these differ.
import { open } from 'node:fs/promises';
import { readFileSync } from 'node:fs';
import { crc32 } from 'node:zlib';
import { McapIndexedReader, McapStreamReader } from '@mcap/core';
import { parse } from '@foxglove/rosmsg';
import { MessageReader } from '@foxglove/rosmsg2-serialization';
import lz4 from '@foxglove/wasm-lz4';
import zstd from '@foxglove/wasm-zstd';

await lz4.isLoaded;
await zstd.isLoaded;
const decompressHandlers = {
  lz4: (bytes, size) => lz4(bytes, Number(size)),
  zstd: (bytes, size) => zstd.decompress(bytes, Number(size)),
};
const sum = (values) => values.reduce((a, b) => a + b, 0);
const NUMBERS = {
  'sensor_msgs/Imu': (m) =>
    m.linear_acceleration.x + m.linear_acceleration.y + m.linear_acceleration.z,
  'sensor_msgs/Image': (m) => m.width * m.height + sum(m.data),
  'sensor_msgs/CameraInfo': (m) => sum(m.k),
  'tf2_msgs/TFMessage': (m) => sum(m.transforms.map((t) => t.transform.translation.x)),
};

const schemas = new Map();
const topics = new Map(); // by channel

function addChannel(channel) {
  if (topics.has(channel.id)) return;
  const schema = schemas.get(channel.schemaId);
  const type = schema.name.replace('/msg/', '/');
  const topic = { name: channel.topic, type, count: 0, check: 0, indexed: 0 };
  if (type in NUMBERS && channel.messageEncoding === 'cdr') {
    const text = new TextDecoder().decode(schema.data);
    topic.reader = new MessageReader(parse(text, { ros2: true }));
    topic.number = 0;
  }
  topics.set(channel.id, topic);
}

const path = process.argv[2];
const stream = new McapStreamReader({ decompressHandlers });
stream.append(readFileSync(path));
for (let record; (record = stream.nextRecord()); ) {
  if (record.type === 'Schema') schemas.set(record.id, record);
  if (record.type === 'Channel') addChannel(record);
  if (record.type !== 'Message') continue;
  const topic = topics.get(record.channelId);
  ++topic.count;
  topic.check += crc32(record.data);
  if (topic.reader) topic.number += NUMBERS[topic.type](topic.reader.readMessage(record.data));
}
if (!stream.done()) throw new Error('the file ends too early');

const file = await open(path);
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, size) => {
    const bytes = new Uint8Array(Number(size));
    await file.read(bytes, 0, Number(size), Number(offset));
    return bytes;
  },
};
const indexed = await McapIndexedReader.Initialize({ readable, decompressHandlers });
if (indexed.chunkIndexes.length > 0) {
  for await (const message of indexed.readMessages()) ++topics.get(message.channelId).indexed;
  for (const topic of topics.values()) {
    if (topic.indexed !== topic.count) throw new Error(`${topic.name}: indexes miss messages`);
  }
}
for (const { name, type, count, check, number } of topics.values()) {
  console.log(name, type, count, check, number === undefined ? '-' : number.toFixed(6));
}
