#!/usr/bin/python3
"""Lists a ROS 1 bag (by Debian's rosbag) or a rosbag2 database (by SQLite alone):
  read_bag.py FILE        a row a topic: NAME TYPE MESSAGES CHECK NUMBER
CHECK is the sum of the CRC-32 of its messages; NUMBER a sum of what is in them, of a bag's images,
IMU samples, calibrations and transforms, "-" of others."""
import sqlite3, sys, zlib


NUMBERS = {
    'sensor_msgs/Imu': lambda m: m.linear_acceleration.x + m.linear_acceleration.y
    + m.linear_acceleration.z,
    'sensor_msgs/Image': lambda m: m.width * m.height + sum(m.data),
    'sensor_msgs/CameraInfo': lambda m: sum(m.K),
    'tf2_msgs/TFMessage': lambda m: sum(t.transform.translation.x for t in m.transforms),
}
NUMBERS['tf/tfMessage'] = NUMBERS['tf2_msgs/TFMessage']


def rows_of_bag(path):
    import rosbag
    rows = {}
    with rosbag.Bag(path) as bag:
        for c in bag._get_connections():
            rows.setdefault((c.topic, c.datatype), [0, 0, None])
        for topic, (kind, data, _, _, message_class), _ in bag.read_messages(raw=True):
            row = rows[topic, kind]
            row[0] += 1
            row[1] += zlib.crc32(data)
            if kind in NUMBERS:
                message = message_class()
                message.deserialize(data)
                row[2] = (row[2] or 0) + NUMBERS[kind](message)
    return rows


def rows_of_database(path):
    db = sqlite3.connect('file:%s?mode=ro' % path, uri=True)
    rows = {}
    for key, name, kind in db.execute('SELECT id, name, type FROM topics'):
        row = rows[name, kind.replace('/msg/', '/')] = [0, 0, None]
        for (data,) in db.execute('SELECT data FROM messages WHERE topic_id = ?', (key,)):
            row[0] += 1
            row[1] += zlib.crc32(data)
    return rows


path = sys.argv[1]
rows = rows_of_database(path) if path.endswith('.db3') else rows_of_bag(path)
for (name, kind), (count, check, value) in rows.items():
    print(name, kind, count, check, '-' if value is None else '%.6f' % value)
