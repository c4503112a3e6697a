-- The others that wait for the receiver of message ?1, too: it may be deaf, and whoever waits behind them is not.
UPDATE webhook_message SET next_ms = max(next_ms, ?2)
 WHERE state = 'waiting' AND webhook = (SELECT webhook FROM webhook_message WHERE id = ?1)
