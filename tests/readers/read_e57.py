#!/usr/bin/python3
"""Reads an E57 file (ASTM E2807, version 1.0) by NumPy alone and checks it against the standard:
  read_e57.py FILE
For each scan a row of its name, record count and fields, and a row a point, of all fields:
  scan NAME count N fields NAME,...
  point NAME=VALUE ...
Fields of extensions are named with their prefix. A file that breaks the standard ends it with
status 1 and a line of what was found and what was expected. Of the standard's fields it knows those
that slcmap writes: floats and integers of 8 bits."""
import collections
import io
import math
import struct
import sys
import xml.etree.ElementTree

import numpy

NAMESPACE = 'http://www.astm.org/COMMIT/E57/2010-e57-v1.0'
FORMAT_NAME = 'ASTM E57 3D Imaging Data File'
HEADER_LENGTH, SECTION_HEADER_LENGTH, INDEX_HEADER_LENGTH = 48, 32, 16
PAGE, CHECKSUM = 1024, 4
CONTENT = PAGE - CHECKSUM
SECTION_ID = 1
INDEX_PACKET, DATA_PACKET, EMPTY_PACKET = 0, 1, 2
CARTESIAN = ('cartesianX', 'cartesianY', 'cartesianZ')
COLOUR = ('colorRed', 'colorGreen', 'colorBlue')
NORMAL = ('nor:normalX', 'nor:normalY', 'nor:normalZ')
POINT_FIELDS = CARTESIAN + COLOUR + ('intensity',)
CHILD = {'Structure', 'Vector', 'CompressedVector'}
TYPES = CHILD | {'Float', 'Integer', 'String'}

Field = collections.namedtuple('Field', 'name kind precision minimum maximum')


class Violation(Exception):
    pass


def expect(holds, what, found, expected):
    if not holds:
        raise Violation('%s: found %s, expected %s' % (what, found, expected))


# Pages and the logical stream.

def crc_table():
    table = numpy.arange(256, dtype=numpy.uint32)
    for _ in range(8):
        table = (table >> 1) ^ numpy.where(table & 1, numpy.uint32(0x82F63B78), numpy.uint32(0))
    return table


def crc32c(rows):
    """The CRC-32C of each row of bytes."""
    table = crc_table()
    crc = numpy.full(len(rows), 0xFFFFFFFF, numpy.uint32)
    for column in numpy.ascontiguousarray(rows.T):
        crc = table[(crc ^ column) & 0xFF] ^ (crc >> 8)
    return ~crc


def logical_stream(pages):
    stored = numpy.ascontiguousarray(pages[:, CONTENT:]).view('>u4')[:, 0]
    computed = crc32c(pages[:, :CONTENT])
    wrong = numpy.flatnonzero(stored != computed)
    if len(wrong):
        page = wrong[0]
        expect(False, 'checksum of page %d' % page, '%08x' % stored[page], '%08x' % computed[page])
    return pages[:, :CONTENT].tobytes()


def logical_offset(physical, what):
    page, rest = divmod(physical, PAGE)
    expect(rest < CONTENT, what, '%d, within a checksum' % physical, 'an offset within content')
    return page * CONTENT + rest


class File:
    def __init__(self, path):
        with open(path, 'rb') as file:
            data = file.read()
        expect(len(data) >= HEADER_LENGTH, 'length of file', len(data), 'a header of 48 bytes')
        signature, major, minor, length, xml_offset, xml_length, page = struct.unpack_from(
            '<8sIIQQQQ', data)
        expect(signature == b'ASTM-E57', 'signature', repr(signature), repr(b'ASTM-E57'))
        expect((major, minor) == (1, 0), 'version in header', '%d.%d' % (major, minor), '1.0')
        expect(page == PAGE, 'page size', page, PAGE)
        expect(length == len(data), 'physical length in header', length, len(data))
        expect(length % PAGE == 0, 'physical length', length, 'a multiple of %d' % PAGE)
        self.version = major, minor
        self.physical_length = length
        self.stream = logical_stream(numpy.frombuffer(data, numpy.uint8).reshape(-1, PAGE))
        self.spans = [(0, HEADER_LENGTH, 'the header')]
        self.xml = self.section(xml_offset, xml_length, 'XML section')

    def section(self, physical, length, what):
        """The bytes of a section, which must be within the file and of no other section."""
        start = logical_offset(physical, 'offset of ' + what)
        end = start + length
        expect(length > 0 and end <= len(self.stream), 'end of ' + what, end,
               'at most %d and after its start, %d' % (len(self.stream), start))
        for other_start, other_end, other in self.spans:
            expect(end <= other_start or start >= other_end, what,
                   'bytes %d to %d' % (start, end),
                   'none of %s, %d to %d' % (other, other_start, other_end))
        self.spans.append((start, end, what))
        return self.stream[start:end]


# The XML section.

class Tree:
    def __init__(self, text):
        self.prefixes = {}
        try:
            text.decode('utf-8')
            events = xml.etree.ElementTree.iterparse(io.BytesIO(text), ('start-ns', 'end'))
            for event, value in events:
                if event == 'start-ns':
                    self.prefixes[value[1]] = value[0]
            self.root = events.root
        except (xml.etree.ElementTree.ParseError, UnicodeDecodeError) as error:
            raise Violation('XML section: found %s, expected well-formed XML in UTF-8' % error)
        expect(self.root.tag == '{%s}e57Root' % NAMESPACE, 'root of XML', self.root.tag,
               'e57Root of ' + NAMESPACE)
        self.check(self.root, 'e57Root')

    def name(self, element):
        uri, _, local = element.tag[1:].rpartition('}')
        expect(uri in self.prefixes, 'namespace of ' + element.tag, repr(uri), 'a declared one')
        expect((uri == NAMESPACE) == (self.prefixes[uri] == ''), 'prefix of ' + element.tag,
               repr(self.prefixes[uri]), 'none for E57 and one for an extension')
        return local if uri == NAMESPACE else self.prefixes[uri] + ':' + local

    def check(self, element, path):
        kind = element.get('type')
        expect(kind in TYPES, 'type of ' + path, kind, 'one of ' + ', '.join(sorted(TYPES)))
        names = [self.name(child) for child in element]
        if kind not in CHILD:
            expect(not names, 'children of ' + path, ', '.join(names), 'none in type ' + kind)
        elif kind == 'Vector':
            expect(set(names) <= {'vectorChild'}, 'children of ' + path, ', '.join(names),
                   'vectorChild')
            expect(element.get('allowHeterogeneousChildren', '0') in '01',
                   'allowHeterogeneousChildren of ' + path,
                   element.get('allowHeterogeneousChildren'), '0 or 1')
        else:
            twice = [name for name in names if names.count(name) > 1]
            expect(not twice, 'children of ' + path, 'several ' + ', '.join(sorted(set(twice))),
                   'one of each name')
        for place, (name, child) in enumerate(zip(names, element)):
            self.check(child, '%s/%s' % (path, place if kind == 'Vector' else name))

    def find(self, element, name, path, kinds):
        """The child of that name, or None; its type must be one of kinds."""
        child = element.find('{%s}%s' % (NAMESPACE, name))
        if child is not None:
            expect(child.get('type') in kinds, 'type of %s/%s' % (path, name), child.get('type'),
                   ' or '.join(kinds))
        return child

    def need(self, element, name, path, kinds):
        child = self.find(element, name, path, kinds)
        expect(child is not None, path, 'no ' + name, 'one')
        return child

    def text(self, element, name, path):
        return self.need(element, name, path, ('String',)).text or ''

    def number(self, element, name, path, kinds=('Float', 'Integer')):
        child = self.need(element, name, path, kinds)
        place = '%s/%s' % (path, name)
        kind = child.get('type')
        read = float if kind == 'Float' else int
        value = parsed(read, (child.text or '').strip() or '0', place)
        for bound, sign in (('minimum', 1), ('maximum', -1)):
            if child.get(bound) is not None:
                limit = parsed(read, child.get(bound), place + ' ' + bound)
                expect(sign * value >= sign * limit, place, value, '%s %s' % (bound, limit))
        return value

    def fields(self, prototype, path):
        return [self.field(self.name(child), child, path) for child in prototype]

    def field(self, name, element, path):
        place = '%s/%s' % (path, name)
        kind = element.get('type')
        expect(kind in ('Float', 'Integer'), 'type of ' + place, kind, 'Float or Integer')
        expect(':' in name or name in POINT_FIELDS, 'field ' + place, name,
               "one of the standard's, or one with an extension's prefix")
        read, ends = (float, (-math.inf, math.inf)) if kind == 'Float' else (int, ('none', 'none'))
        low, high = (parsed(read, element.get(key, end), '%s %s' % (place, key))
                     for key, end in zip(('minimum', 'maximum'), ends))
        expect(low <= high, 'limits of ' + place, '%s to %s' % (low, high), 'minimum <= maximum')
        if kind == 'Integer':
            expect((low, high) == (0, 255), 'limits of ' + place, '%d to %d' % (low, high), '0, 255')
        precision = element.get('precision', 'double')
        expect(precision in ('single', 'double'), 'precision of ' + place, precision,
               'single or double')
        return Field(name, kind, precision, low, high)


def parsed(read, text, what):
    try:
        return read(text)
    except ValueError:
        raise Violation('%s: found %r, expected a number (%s)' % (what, text, read.__name__))


# CompressedVector sections.

def packets(section, what):
    """Type, offset in the section and bytes of each packet."""
    start = SECTION_HEADER_LENGTH
    while start < len(section):
        kind, _, length = struct.unpack_from('<BBH', section, start)
        length += 1
        place = '%s, packet at byte %d' % (what, start)
        expect(kind in (INDEX_PACKET, DATA_PACKET, EMPTY_PACKET), 'type of ' + place, kind,
               '0, 1 or 2')
        expect(length % 4 == 0 and length >= 4, 'length of ' + place, length, 'a multiple of 4')
        expect(start + length <= len(section), 'end of ' + place, start + length,
               "at most the section's, %d" % len(section))
        yield kind, start, section[start:start + length], place
        start += length


def bytestreams(packet, count, place):
    """Whether compressors start anew in a data packet, and its bytestreams."""
    expect(len(packet) >= 6 + 2 * count, 'length of ' + place, len(packet),
           'at least %d' % (6 + 2 * count))
    _, flags, _, found = struct.unpack_from('<BBHH', packet)
    expect(flags in (0, 1), 'flags of ' + place, flags, '0 or 1')
    expect(found == count, 'bytestreams of ' + place, found, '%d, one a field' % count)
    lengths = struct.unpack_from('<%dH' % count, packet, 6)
    ends = 6 + 2 * count + numpy.cumsum((0,) + lengths)
    needed = int(ends[-1])
    expect(needed <= len(packet) < needed + 4, 'length of ' + place, len(packet),
           '%d of its bytestreams, and less than 4 of padding' % needed)
    expect(not any(packet[needed:]), 'padding of ' + place, packet[needed:].hex(), 'zeros')
    return flags == 1, [packet[a:b] for a, b in zip(ends[:-1], ends[1:])]


def check_index(packet, count, starts, place):
    """starts: physical offsets of the section's packets, data and index."""
    expect(len(packet) >= INDEX_HEADER_LENGTH, 'length of ' + place, len(packet), 'at least 16')
    entries, level = struct.unpack_from('<HB', packet, 4)
    expect(not any(packet[7:16]), 'reserved bytes of ' + place, packet[7:16].hex(), 'zeros')
    expect(level <= 5, 'level of ' + place, level, 'at most 5')
    expect(1 <= entries <= 2048, 'entries of ' + place, entries, '1 to 2048')
    expect(len(packet) >= 16 + 16 * entries, 'length of ' + place, len(packet),
           'at least %d for %d entries' % (16 + 16 * entries, entries))
    pairs = numpy.frombuffer(packet, '<u8', 2 * entries, 16).reshape(-1, 2)
    records = pairs[:, 0].astype(object)
    expect(records[-1] < max(count, 1), 'last record in ' + place, records[-1],
           'less than %d' % count)
    expect(all(records[1:] > records[:-1]), 'records in ' + place, list(records), 'ascending ones')
    wanted = starts[INDEX_PACKET if level else DATA_PACKET]
    for physical in pairs[:, 1]:
        expect(int(physical) in wanted, 'offset in ' + place, physical,
               'that of %s packet of the section' % ('an index' if level else 'a data'))


def vector_section(file, physical, what):
    start = logical_offset(physical, 'offset of ' + what)
    expect(start + SECTION_HEADER_LENGTH <= len(file.stream), 'offset of ' + what, physical,
           "a section's header within the file")
    length, = struct.unpack_from('<Q', file.stream, start + 8)
    expect(length >= SECTION_HEADER_LENGTH and length % 4 == 0, 'length of ' + what, length,
           'a multiple of 4, at least %d' % SECTION_HEADER_LENGTH)
    section = file.section(physical, length, what)
    expect(section[0] == SECTION_ID, 'section id of ' + what, section[0], SECTION_ID)
    expect(not any(section[1:8]), 'reserved bytes of ' + what, section[1:8].hex(), 'zeros')
    return start, section


def physical_of(logical):
    page, rest = divmod(logical, CONTENT)
    return page * PAGE + rest


def runs_of_bytes(file, physical, count, fields, what):
    """The bytes of each field, in a list for each start of the compressors."""
    start, section = vector_section(file, physical, what)
    data_offset, index_offset = struct.unpack_from('<QQ', section, 16)
    starts = {INDEX_PACKET: [], DATA_PACKET: [], EMPTY_PACKET: []}
    runs, indices = [], []
    for kind, place, packet, name in packets(section, what):
        starts[kind].append(physical_of(start + place))
        if kind == INDEX_PACKET:
            indices.append((packet, name))
        elif kind == DATA_PACKET:
            anew, streams = bytestreams(packet, len(fields), name)
            if anew or not runs:
                runs.append([[] for _ in fields])
            for parts, stream in zip(runs[-1], streams):
                parts.append(stream)
    if count or starts[DATA_PACKET]:
        expect(data_offset in starts[DATA_PACKET][:1], 'dataPhysicalOffset of ' + what,
               data_offset, 'that of the first data packet, %s' % starts[DATA_PACKET][:1])
    expect(index_offset in starts[INDEX_PACKET] or (index_offset == 0 and not indices),
           'indexPhysicalOffset of ' + what, index_offset,
           'that of an index packet, one of %s' % starts[INDEX_PACKET])
    for packet, name in indices:
        check_index(packet, count, starts, name)
    return [[b''.join(parts) for parts in run] for run in runs]


def bits_of(field):
    return 8 if field.kind == 'Integer' else 32 if field.precision == 'single' else 64


def decoded(field, data, count, what):
    bits = bits_of(field)
    needed = count * bits // 8
    # A bit-packed stream may be filled up to a word of 8 bytes.
    most = needed if field.kind == 'Float' else needed + 7
    expect(needed <= len(data) <= most, 'bytes of %s/%s' % (what, field.name), len(data),
           '%d for %d records of %d bits' % (needed, count, bits))
    values = numpy.frombuffer(data[:needed], {8: 'u1', 32: '<f4', 64: '<f8'}[bits])
    check_range(values, field.minimum, field.maximum, '%s/%s' % (what, field.name))
    return values


def vector(file, physical, count, fields, what):
    """The stored values of each field."""
    runs = runs_of_bytes(file, physical, count, fields, what)
    columns = [[] for _ in fields]
    left = count
    for place, run in enumerate(runs):
        # All runs but the last are as long as their shortest stream.
        lengths = [len(data) * 8 // bits_of(field) for field, data in zip(fields, run)]
        number = left if place == len(runs) - 1 else min(lengths + [left])
        for column, field, data in zip(columns, fields, run):
            column.append(decoded(field, data, number, what))
        left -= number
    expect(left == 0, 'records of ' + what, count - left, count)
    return [numpy.concatenate(column) if column else numpy.empty(0) for column in columns]


# Scans.

def check_range(values, low, high, what):
    if len(values) == 0:
        return
    slack = 1e-12 * max([1] + [abs(end) for end in (low, high) if math.isfinite(end)])
    least, most = values.min().item(), values.max().item()
    expect(least >= low - slack, 'least of ' + what, least, 'at least %r' % low)
    expect(most <= high + slack, 'greatest of ' + what, most, 'at most %r' % high)


def check_fields(fields, path):
    names = {field.name for field in fields}
    expect(names.issuperset(CARTESIAN), 'fields of ' + path, ', '.join(sorted(names)),
           'three cartesian coordinates')
    for group in (COLOUR, NORMAL):
        some = names.intersection(group)
        expect(len(some) in (0, len(group)), 'fields of ' + path, ', '.join(sorted(some)),
               'all or none of ' + ', '.join(group))


def check_limits(tree, scan, path, columns, structure, names):
    """That the values of these fields are within those of a structure of limits, if it is there."""
    limits = tree.find(scan, structure, path, ('Structure',))
    if limits is None:
        return
    place = '%s/%s' % (path, structure)
    for name in names:
        stem = name.replace('cartesian', '').lower() if name in CARTESIAN else name
        low = tree.number(limits, stem + 'Minimum', place)
        high = tree.number(limits, stem + 'Maximum', place)
        expect(low <= high, place, '%r to %r' % (low, high), 'minimum <= maximum')
        if name in columns:
            check_range(columns[name], low, high, '%s, of %s' % (name, place))


def positive(element, key, path):
    expect(element.get(key) is not None, path, 'no ' + key, 'one')
    value = parsed(int, element.get(key), '%s %s' % (path, key))
    expect(value >= 0, '%s %s' % (path, key), value, 'at least 0')
    return value


def read_scan(file, tree, scan, path):
    points = tree.need(scan, 'points', path, ('CompressedVector',))
    what = path + '/points'
    prototype = tree.need(points, 'prototype', what, ('Structure',))
    tree.need(points, 'codecs', what, ('Vector',))
    fields = tree.fields(prototype, what + '/prototype')
    check_fields(fields, what)
    names = {field.name for field in fields}
    if 'intensity' in names:
        tree.need(scan, 'intensityLimits', path, ('Structure',))
    if 'colorRed' in names:
        tree.need(scan, 'colorLimits', path, ('Structure',))
    count = positive(points, 'recordCount', what)
    stored = vector(file, positive(points, 'fileOffset', what), count, fields, what)
    columns = {field.name: values for field, values in zip(fields, stored)}
    check_limits(tree, scan, path, columns, 'cartesianBounds', CARTESIAN)
    check_limits(tree, scan, path, columns, 'intensityLimits', ('intensity',))
    check_limits(tree, scan, path, columns, 'colorLimits', COLOUR)
    return count, fields, columns


def rows(file, tree):
    root = tree.root
    name = tree.text(root, 'formatName', 'e57Root')
    expect(name == FORMAT_NAME, 'formatName', repr(name), repr(FORMAT_NAME))
    guids = [tree.text(root, 'guid', 'e57Root')]
    version = tuple(tree.number(root, key, 'e57Root', ('Integer',))
                    for key in ('versionMajor', 'versionMinor'))
    expect(version == file.version, 'version in XML', '%d.%d' % version,
           "the header's, %d.%d" % file.version)
    data = tree.need(root, 'data3D', 'e57Root', ('Vector',))
    for place, scan in enumerate(data):
        path = 'data3D/%d' % place
        expect(scan.get('type') == 'Structure', 'type of ' + path, scan.get('type'), 'Structure')
        guids.append(tree.text(scan, 'guid', path))
        expect(guids[-1] != '' and guids[-1] not in guids[:-1], 'guid of ' + path,
               repr(guids[-1]), 'one of its own')
        name = tree.find(scan, 'name', path, ('String',))
        count, fields, columns = read_scan(file, tree, scan, path)
        yield 'scan %s count %d fields %s' % (
            '-' if name is None else name.text, count, ','.join(field.name for field in fields))
        texts = [[field.name + '=' + str(value) for value in columns[field.name]]
                 for field in fields]
        for values in zip(*texts):
            yield 'point ' + ' '.join(values)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    try:
        file = File(sys.argv[1])
        for row in rows(file, Tree(file.xml)):
            print(row)
    except (Violation, OSError) as problem:
        sys.stdout.flush()
        print(problem, file=sys.stderr)
        sys.exit(1)


if __name__ == '__main__':
    main()
