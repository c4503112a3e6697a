DELETE FROM webhook_message WHERE state <> 'waiting' AND created_ms < ?1
