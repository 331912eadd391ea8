"""What schemathesis needs to know about this API: bodies of uploads are bytes."""
import schemathesis


@schemathesis.serializer("application/offset+octet-stream")
def upload_bytes(context, value):
    return value if isinstance(value, bytes) else str(value).encode()
