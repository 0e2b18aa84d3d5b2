"""What is said on the wire and how: vocabulary, messages, codecs, links, peer, and the C firmware that speaks it."""
