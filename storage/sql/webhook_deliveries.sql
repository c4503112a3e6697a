SELECT id, type, state, attempt, next_ms, created_ms, answer FROM webhook_message WHERE webhook = ?1 ORDER BY seq DESC LIMIT ?2
