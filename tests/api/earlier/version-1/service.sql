PRAGMA foreign_keys=OFF;
BEGIN TRANSACTION;
CREATE TABLE users (
	name VARCHAR(64) NOT NULL, 
	role VARCHAR(16) NOT NULL, 
	password_hash VARCHAR(255) NOT NULL, 
	created DOUBLE NOT NULL, 
	PRIMARY KEY (name)
);
INSERT INTO users VALUES('ada','admin','$argon2id$v=19$m=65536,t=3,p=4$mCOFAVBH/tXNs0fn+avkwQ$tBUEir+1Fsn2k5AsfCeEaiZW9/uZguCvkovVTR8xugM',1795837076.8454735279);
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
INSERT INTO audit_log VALUES(1,1795837076.9394400119,'ada','admin','testclient','POST /experiments/{experiment}/models','/experiments/pendulum/models','202','{}');
INSERT INTO audit_log VALUES(2,1795837077.2024729251,'ada','admin','testclient','POST /experiments','/experiments','201','{}');
INSERT INTO audit_log VALUES(3,1795837082.9789383411,'ada','admin','testclient','POST /experiments/{experiment}/models/{model}/diagnosis','/experiments/pendulum/models/m1/diagnosis','202','{}');
INSERT INTO audit_log VALUES(4,1795837092.236027956,'ada','admin','testclient','POST /rigs/{rig}/take','/rigs/rx130l-joint3-simulated/take','200','{}');
INSERT INTO audit_log VALUES(5,1795837092.3267054557,'ada','admin','testclient','POST /experiments/{experiment}/sessions','/experiments/arm/sessions','201','{}');
INSERT INTO audit_log VALUES(6,1795837092.352357626,'ada','admin','testclient','POST /experiments/{experiment}/sessions/{session}/weigh','/experiments/arm/sessions/session-00/weigh','200','{}');
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
INSERT INTO jobs VALUES('859b84f6b37e72b0','identify','pendulum','ada','done',1.0,'done',1795837076.908198595,1795837082.7608435153,'{"model": "m1"}');
INSERT INTO jobs VALUES('f21204560024b0fd','diagnose','pendulum','ada','done',1.0,'done',1795837082.9711561202,1795837092.0354053974,'{"model": "m1", "diagnosis": "m1"}');
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
INSERT INTO experiments VALUES('arm','arm','arm','["j3"]','[{"name": "none", "mass": 0.0, "com": [0.0, 0.0, 0.0], "inertia": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}, {"name": "disk-3.5", "mass": 3.4584, "com": [1.277, 0.0, 0.0], "inertia": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}, {"name": "disk-7", "mass": 6.97, "com": [1.277, 0.0, 0.0], "inertia": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}]',1795837077.0900688171,NULL);
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
INSERT INTO tokens VALUES('c869f6cfc566faa7','ada','notebook','2d4d646c28756f0e776ca1dbf9cf18d752099aad342e1ba3a8e720bf15143d45','admin',1795837076.8618409633,1821757076.8618409633,1795837076.8833112717);
CREATE TABLE sessions (
	experiment VARCHAR(64) NOT NULL, 
	id VARCHAR(255) NOT NULL, 
	file VARCHAR(300), 
	payload JSON NOT NULL, 
	role VARCHAR(20) NOT NULL, 
	rig VARCHAR(64), 
	"plan" VARCHAR(64), 
	state VARCHAR(20) NOT NULL, 
	reason VARCHAR(1000), 
	created DOUBLE NOT NULL, 
	PRIMARY KEY (experiment, id), 
	FOREIGN KEY(experiment) REFERENCES experiments (id) ON DELETE CASCADE
);
INSERT INTO sessions VALUES('pendulum','session-00','session-00.csv','{"name": "none", "mass": 0.0, "com": [0.0, 0.0, 0.0], "inertia": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}','identification',NULL,NULL,'measured',NULL,1795837075.6857469081);
INSERT INTO sessions VALUES('pendulum','session-01','session-01.csv','{"name": "disk", "mass": 3.0, "com": [0.5, 0.0, 0.0], "inertia": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}','identification',NULL,NULL,'measured',NULL,1795837075.6859736442);
INSERT INTO sessions VALUES('arm','session-00',NULL,'{"name": "none", "mass": 0.0, "com": [0.0, 0.0, 0.0], "inertia": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0], "weighed": 0.0}','identification','rx130l-joint3-simulated','standard','new',NULL,1795837092.2985589504);
CREATE INDEX ix_audit_log_time ON audit_log (time);
CREATE INDEX ix_jobs_experiment ON jobs (experiment);
CREATE INDEX ix_experiments_name ON experiments (name);
CREATE INDEX ix_sign_ins_user ON sign_ins (user);
CREATE INDEX ix_tokens_user ON tokens (user);
CREATE TRIGGER audit_log_no_update BEFORE UPDATE ON audit_log BEGIN SELECT RAISE(ABORT, 'the audit log is append-only'); END;
CREATE TRIGGER audit_log_no_delete BEFORE DELETE ON audit_log BEGIN SELECT RAISE(ABORT, 'the audit log is append-only'); END;
COMMIT;
