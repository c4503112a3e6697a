-- The others of the same project that wait for the receiver of message ?1 or its host, too: it may be deaf, and whoever
-- waits behind them is not. A host is what lies between "://" and the next "/".
WITH place AS (
  SELECT id, project, substr(url, instr(url, '://') + 3) || '/' AS rest FROM webhook
), host AS (
  SELECT id, project, lower(substr(rest, 1, instr(rest, '/') - 1)) AS name FROM place
), deaf AS (
  SELECT host.project, host.name FROM host JOIN webhook_message AS message ON message.webhook = host.id WHERE message.id = ?1
)
UPDATE webhook_message SET next_ms = max(next_ms, ?2)
 WHERE state = 'waiting' AND webhook IN (SELECT host.id FROM host JOIN deaf ON deaf.project = host.project AND deaf.name = host.name)
