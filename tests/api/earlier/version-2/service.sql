PRAGMA foreign_keys=OFF;
BEGIN TRANSACTION;
CREATE TABLE schema (version INTEGER NOT NULL);
INSERT INTO schema VALUES(2);
CREATE TABLE users (
	name VARCHAR(64) NOT NULL, 
	role VARCHAR(16) NOT NULL, 
	password_hash VARCHAR(255) NOT NULL, 
	created DOUBLE NOT NULL, 
	PRIMARY KEY (name)
);
INSERT INTO users VALUES('ada','admin','$argon2id$v=19$m=65536,t=3,p=4$FQKiJNxsI8fDvQiwgytPFg$awZ55T/Bk44NXH1C8jX//82Hmr4HarySL4uyLdVfECY',1795837107.6911690234);
CREATE TABLE audit_log (
	id INTEGER NOT NULL, 
	time DOUBLE NOT NULL, 
	user VARCHAR(64) NOT NULL, 
	role VARCHAR(16) NOT NULL, 
	client VARCHAR(64) NOT NULL, 
	action VARCHAR(200) NOT NULL, 
	target VARCHAR(300) NOT NULL, 
	outcome VARCHAR(300) NOT NULL, 
	details JSON NOT NULL, 
	PRIMARY KEY (id)
);
INSERT INTO audit_log VALUES(1,1795837107.7712671756,'ada','admin','testclient','POST /experiments/{experiment}/models','/experiments/pendulum/models','202','{}');
INSERT INTO audit_log VALUES(2,1795837116.3972132205,'ada','admin','testclient','POST /experiments','/experiments','201','{}');
INSERT INTO audit_log VALUES(3,1795837118.4440991878,'ada','admin','testclient','POST /experiments/{experiment}/models/{model}/diagnosis','/experiments/pendulum/models/m1/diagnosis','202','{}');
INSERT INTO audit_log VALUES(4,1795837125.4918577671,'ada','admin','testclient','POST /rigs/{rig}/take','/rigs/rx130l-joint3-simulated/take','200','{}');
INSERT INTO audit_log VALUES(5,1795837125.5620105267,'ada','admin','testclient','POST /experiments/{experiment}/sessions','/experiments/arm/sessions','201','{}');
INSERT INTO audit_log VALUES(6,1795837125.6045093536,'ada','admin','testclient','POST /experiments/{experiment}/sessions/{session}/weigh','/experiments/arm/sessions/session-00/weigh','200','{}');
CREATE TABLE jobs (
	id VARCHAR(32) NOT NULL, 
	kind VARCHAR(32) NOT NULL, 
	experiment VARCHAR(64), 
	user VARCHAR(64) NOT NULL, 
	state VARCHAR(16) NOT NULL, 
	fraction DOUBLE NOT NULL, 
	words VARCHAR(1000) NOT NULL, 
	created DOUBLE NOT NULL, 
	ended DOUBLE, 
	result JSON NOT NULL, 
	PRIMARY KEY (id)
);
INSERT INTO jobs VALUES('9e55be41ad3ef438','identify','pendulum','ada','done',1.0,'done',1795837107.7399454116,1795837118.1539199352,'{"model": "m1"}');
INSERT INTO jobs VALUES('27ba2536fac3e7bb','diagnose','pendulum','ada','done',1.0,'done',1795837118.4402480125,1795837125.2661805153,'{"model": "m1", "diagnosis": "m1"}');
CREATE TABLE experiments (
	id VARCHAR(64) NOT NULL, 
	name VARCHAR(255) NOT NULL, 
	folder VARCHAR(1000) NOT NULL, 
	joints JSON NOT NULL, 
	payloads JSON NOT NULL, 
	modified DOUBLE NOT NULL, 
	problem VARCHAR(1000), 
	PRIMARY KEY (id), 
	UNIQUE (folder)
);
INSERT INTO experiments VALUES('pendulum','pendulum','pendulum','["j1"]','[{"name": "none", "mass": 0.0, "com": [0.0, 0.0, 0.0], "inertia": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}, {"name": "disk", "mass": 3.0, "com": [0.5, 0.0, 0.0], "inertia": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}]',1795836956.565016508,NULL);
INSERT INTO experiments VALUES('arm','arm','arm','["j3"]','[{"name": "none", "mass": 0.0, "com": [0.0, 0.0, 0.0], "inertia": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}, {"name": "disk-3.5", "mass": 3.4584, "com": [1.277, 0.0, 0.0], "inertia": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}, {"name": "disk-7", "mass": 6.97, "com": [1.277, 0.0, 0.0], "inertia": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}]',1795837107.8304283619,NULL);
CREATE TABLE sign_ins (
	id_hash VARCHAR(64) NOT NULL, 
	user VARCHAR(64) NOT NULL, 
	expires DOUBLE NOT NULL, 
	PRIMARY KEY (id_hash), 
	FOREIGN KEY(user) REFERENCES users (name) ON DELETE CASCADE
);
CREATE TABLE tokens (
	id VARCHAR(32) NOT NULL, 
	user VARCHAR(64) NOT NULL, 
	label VARCHAR(100) NOT NULL, 
	token_hash VARCHAR(64) NOT NULL, 
	scope VARCHAR(16) NOT NULL, 
	created DOUBLE NOT NULL, 
	expires DOUBLE NOT NULL, 
	last_used DOUBLE, 
	PRIMARY KEY (id), 
	FOREIGN KEY(user) REFERENCES users (name) ON DELETE CASCADE, 
	UNIQUE (token_hash)
);
INSERT INTO tokens VALUES('656cbc79634cad1a','ada','notebook','18bacc65e1a1d4202effa749296ec95ac2a04dd24556b7787a81f96a61fda85a','admin',1795837107.6952748298,1821757107.6952748299,1795837107.7150752544);
CREATE TABLE sessions (
	experiment VARCHAR(64) NOT NULL, 
	id VARCHAR(255) NOT NULL, 
	file VARCHAR(300), 
	payload JSON NOT NULL, 
	weighed DOUBLE, 
	role VARCHAR(20) NOT NULL, 
	rig VARCHAR(64), 
	"plan" VARCHAR(64), 
	state VARCHAR(20) NOT NULL, 
	reason VARCHAR(1000), 
	created DOUBLE NOT NULL, 
	PRIMARY KEY (experiment, id), 
	FOREIGN KEY(experiment) REFERENCES experiments (id) ON DELETE CASCADE
);
INSERT INTO sessions VALUES('pendulum','session-00','session-00.csv','{"name": "none", "mass": 0.0, "com": [0.0, 0.0, 0.0], "inertia": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}',NULL,'identification',NULL,NULL,'measured',NULL,1795837106.8806946277);
INSERT INTO sessions VALUES('pendulum','session-01','session-01.csv','{"name": "disk", "mass": 3.0, "com": [0.5, 0.0, 0.0], "inertia": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}',NULL,'identification',NULL,NULL,'measured',NULL,1795837106.8808300494);
INSERT INTO sessions VALUES('arm','session-00',NULL,'{"name": "none", "mass": 0.0, "com": [0.0, 0.0, 0.0], "inertia": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}',0.0,'identification','rx130l-joint3-simulated','standard','new',NULL,1795837125.5306015014);
CREATE INDEX ix_audit_log_time ON audit_log (time);
CREATE INDEX ix_jobs_experiment ON jobs (experiment);
CREATE INDEX ix_experiments_name ON experiments (name);
CREATE INDEX ix_sign_ins_user ON sign_ins (user);
CREATE INDEX ix_tokens_user ON tokens (user);
CREATE TRIGGER audit_log_no_update BEFORE UPDATE ON audit_log BEGIN SELECT RAISE(ABORT, 'the audit log is append-only'); END;
CREATE TRIGGER audit_log_no_delete BEFORE DELETE ON audit_log BEGIN SELECT RAISE(ABORT, 'the audit log is append-only'); END;
COMMIT;
