INSERT INTO audit (at_ms, who, project, action, object, outcome, hash) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)
