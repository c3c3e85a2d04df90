"""Reads the CSV, Parquet and MCAP of one log with DuckDB and mcap: they have to hold the same samples, value by value.

Arguments: CSV, Parquet and MCAP. Prints a JSON document of what they hold.
"""

import json
import sys

import duckdb
import numpy
from mcap.reader import make_reader

# Messages of a topic that are held against its schema; all are against the table.
CHECKED = 1000
JSON_TYPES = {"integer": int, "number": (int, float), "boolean": bool, "string": str, "object": dict}


def read_tables(csv, parquet):
    """The rows, after both files have been found to hold the same."""
    typed = duckdb.read_parquet(parquet)
    types = dict(zip(typed.columns, map(str, typed.types)))
    casts = ", ".join(f'"{name}"::{kind} AS "{name}"' for name, kind in types.items())
    text = duckdb.read_csv(csv, sample_size=-1)
    assert text.columns == typed.columns, (text.columns, typed.columns)
    rows = typed.fetchall()
    assert rows == text.project(casts).fetchall(), "the rows, in their order"
    return types, [dict(zip(types, row)) for row in rows]


def check_schema(schema, message):
    assert schema["type"] == "object" and set(schema["required"]) <= set(message), (schema, message)
    for key, value in message.items():
        rule = schema["properties"][key]
        if "oneOf" in rule:
            assert value in [option["const"] for option in rule["oneOf"]], (key, value)
            continue
        assert isinstance(value, JSON_TYPES[rule["type"]]), (key, value)
        if rule["type"] == "integer":
            assert not isinstance(value, bool), (key, value)
        if rule["type"] == "object":
            check_schema(rule, value)


def read_messages(path):
    """Messages by topic, in the file's order, with their times; and the file's metadata. Every chunk has messages and their times."""
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        topics = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            assert (channel.message_encoding, schema.encoding) == ("json", "jsonschema")
            content = json.loads(message.data)
            messages = topics.setdefault(channel.topic, [])
            if len(messages) < CHECKED:
                check_schema(json.loads(schema.data), content)
            messages.append((message, content))
        metadata = {entry.name: entry.metadata for entry in reader.iter_metadata()}
        summary = reader.get_summary()
        statistics = summary.statistics
        counts = {summary.channels[channel].topic: count for channel, count in statistics.channel_message_counts.items()}
    times = [message.log_time for messages in topics.values() for message, _ in messages]
    assert 0 < min(times) == statistics.message_start_time and max(times) == statistics.message_end_time
    assert summary.chunk_indexes
    for chunk in summary.chunk_indexes:
        assert chunk.message_start_time > 0 and chunk.message_index_offsets, chunk
    assert counts == {topic: len(messages) for topic, messages in topics.items()}
    return topics, metadata


def known(row):
    return {name: value for name, value in row.items() if value is not None}


def axes(quaternion):
    """The x and y axis that a unit quaternion turns to, by its product with both."""
    x, y, z, w = (quaternion[key] for key in "xyzw")
    assert abs(numpy.linalg.norm([x, y, z, w]) - 1) < 1e-12
    u = numpy.array([x, y, z])
    turn = lambda v: v + 2 * numpy.cross(u, numpy.cross(u, v) + w * v)
    return [turn(numpy.array(axis)).tolist() for axis in ([1.0, 0, 0], [0, 1.0, 0])]


def main(csv, parquet, mcap):
    types, rows = read_tables(csv, parquet)
    topics, metadata = read_messages(mcap)
    samples = topics.get("/samples", [])
    assert [content for _, content in samples] == [known(row) for row in rows]
    for topic in ("/samples", "/settled", "/bar"):
        for message, content in topics.get(topic, []):
            assert message.sequence == content["index"], content
            assert "unix_us" not in content or message.log_time == content["unix_us"] * 1000, content
    for topic in ("/tool_pose", "/log"):
        for message, content in topics.get(topic, []):
            time = content["timestamp"]
            assert message.log_time == time["sec"] * 10**9 + time["nsec"], content
    facts = duckdb.sql(f"SELECT decode(key), decode(value) FROM parquet_kv_metadata('{parquet}')").fetchall()
    groups = duckdb.sql(f"SELECT count(DISTINCT row_group_id) FROM parquet_metadata('{parquet}')").fetchall()[0][0]
    poses = [
        {"at": list(content["pose"]["position"].values()), "axes": axes(content["pose"]["orientation"])}
        for _, content in topics.get("/tool_pose", [])
    ]
    document = {
        "types": types,
        "rows": [rows[0], rows[-1]] if rows else [],
        "segments": sorted({row["segment"] for row in rows}),
        "messages": {topic: len(messages) for topic, messages in topics.items()},
        "settled": [content for _, content in topics.get("/settled", [])],
        "bar": [content for _, content in topics.get("/bar", [])],
        "poses": poses,
        "log": [content["message"] for _, content in topics.get("/log", [])],
        "facts": dict(facts),
        "metadata": metadata["ballbar"],
        "row_groups": groups,
        "row_count": len(rows),
    }
    print(json.dumps(document))


main(*sys.argv[1:])
