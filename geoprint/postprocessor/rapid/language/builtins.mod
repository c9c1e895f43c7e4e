MODULE Builtins
! What a controller brings: types, data, instructions and functions, as RAPID would declare them. A record without
! components is a type whose inside is closed or unknown; a constant without a value depends on the controller.
! Facts from ABB 3HAC050917 (instructions, functions and data types, RobotWare 6) as public extracts have it.
RECORD num ENDRECORD
RECORD dnum ENDRECORD
RECORD string ENDRECORD
RECORD bool ENDRECORD
RECORD anytype ENDRECORD
RECORD switch ENDRECORD
RECORD clock ENDRECORD
RECORD iodev ENDRECORD
RECORD dir ENDRECORD
RECORD rawbytes ENDRECORD
RECORD socketdev ENDRECORD
RECORD mecunit ENDRECORD
RECORD taskid ENDRECORD
RECORD syncident ENDRECORD
RECORD loadsession ENDRECORD
RECORD triggdata ENDRECORD
RECORD corrdescr ENDRECORD
RECORD datapos ENDRECORD
RECORD egmident ENDRECORD
RECORD wzstationary ENDRECORD
RECORD wztemporary ENDRECORD
RECORD shapedata ENDRECORD
RECORD restartdata ENDRECORD
RECORD trapdata ENDRECORD
RECORD cameradev ENDRECORD
RECORD sensor ENDRECORD
RECORD pathrecid ENDRECORD
RECORD rmqslot ENDRECORD
RECORD rmqmessage ENDRECORD
RECORD motsetdata ENDRECORD
RECORD cameratarget ENDRECORD
RECORD sensorvardata ENDRECORD
RECORD testsignal ENDRECORD
RECORD signaldi ENDRECORD
RECORD signaldo ENDRECORD
RECORD signalai ENDRECORD
RECORD signalao ENDRECORD
RECORD signalgi ENDRECORD
RECORD signalgo ENDRECORD
RECORD pos num x; num y; num z; ENDRECORD
RECORD orient num q1; num q2; num q3; num q4; ENDRECORD
RECORD pose pos trans; orient rot; ENDRECORD
RECORD confdata num cf1; num cf4; num cf6; num cfx; ENDRECORD
RECORD robjoint num rax_1; num rax_2; num rax_3; num rax_4; num rax_5; num rax_6; ENDRECORD
RECORD extjoint num eax_a; num eax_b; num eax_c; num eax_d; num eax_e; num eax_f; ENDRECORD
RECORD robtarget pos trans; orient rot; confdata robconf; extjoint extax; ENDRECORD
RECORD jointtarget robjoint robax; extjoint extax; ENDRECORD
RECORD loaddata num mass; pos cog; orient aom; num ix; num iy; num iz; ENDRECORD
RECORD tooldata bool robhold; pose tframe; loaddata tload; ENDRECORD
RECORD wobjdata bool robhold; bool ufprog; string ufmec; pose uframe; pose oframe; ENDRECORD
RECORD speeddata num v_tcp; num v_ori; num v_leax; num v_reax; ENDRECORD
RECORD zonedata bool finep; num pzone_tcp; num pzone_ori; num pzone_eax; num zone_ori; num zone_leax; num zone_reax; ENDRECORD
RECORD progdisp pose pdisp; extjoint eoffs; ENDRECORD
RECORD inposdata num position; num speed; num mintime; num maxtime; ENDRECORD
RECORD stoppointdata stoppoint type; bool progsynch; inposdata inpos; num stoptime; num followtime; string signal; opnum relation; num checkvalue; ENDRECORD
RECORD tasks string taskname; ENDRECORD
RECORD listitem string image; string text; ENDRECORD
RECORD egm_minmax num min; num max; ENDRECORD
RECORD rmqheader string datatype; num ndim; num dim1; num dim2; num dim3; ENDRECORD
ALIAS num dionum;
ALIAS num errnum;
ALIAS num intnum;
ALIAS num symnum;
ALIAS num opnum;
ALIAS num opcalc;
ALIAS num tunetype;
ALIAS num tunegtype;
ALIAS num btnres;
ALIAS num icondata;
ALIAS num buttondata;
ALIAS num tpnum;
ALIAS num byte;
ALIAS num identno;
ALIAS num errdomain;
ALIAS num errtype;
ALIAS num event_type;
ALIAS num handler_type;
ALIAS num exec_level;
ALIAS num triggmode;
ALIAS num socketstatus;
ALIAS num egmstate;
ALIAS num egmframetype;
ALIAS num egmstopmode;
ALIAS num iounit_state;
ALIAS num busstate;
ALIAS num loadidnum;
ALIAS num paridnum;
ALIAS num paridvalidnum;
ALIAS num uishownum;
ALIAS num tsp_status;
ALIAS num cfgdomain;
ALIAS num signalorigin;
ALIAS num aiotrigg;
ALIAS num inttypes;
ALIAS num motionprocessmode;
ALIAS num sensorstate;
ALIAS num stoppoint;
ALIAS string stringdig;
ALIAS string errstr;
CONST zonedata fine:=[TRUE,0,0,0,0,0,0];
CONST zonedata z0:=[FALSE,0.3,0.3,0.3,0.03,0.3,0.03];
CONST zonedata z1:=[FALSE,1,1,1,0.1,1,0.1];
CONST zonedata z5:=[FALSE,5,8,8,0.8,8,0.8];
CONST zonedata z10:=[FALSE,10,15,15,1.5,15,1.5];
CONST zonedata z15:=[FALSE,15,23,23,2.3,23,2.3];
CONST zonedata z20:=[FALSE,20,30,30,3,30,3];
CONST zonedata z30:=[FALSE,30,45,45,4.5,45,4.5];
CONST zonedata z40:=[FALSE,40,60,60,6,60,6];
CONST zonedata z50:=[FALSE,50,75,75,7.5,75,7.5];
CONST zonedata z60:=[FALSE,60,90,90,9,90,9];
CONST zonedata z80:=[FALSE,80,120,120,12,120,12];
CONST zonedata z100:=[FALSE,100,150,150,15,150,15];
CONST zonedata z150:=[FALSE,150,225,225,23,225,23];
CONST zonedata z200:=[FALSE,200,300,300,30,300,30];
CONST speeddata v5:=[5,500,5000,1000];
CONST speeddata v10:=[10,500,5000,1000];
CONST speeddata v20:=[20,500,5000,1000];
CONST speeddata v30:=[30,500,5000,1000];
CONST speeddata v40:=[40,500,5000,1000];
CONST speeddata v50:=[50,500,5000,1000];
CONST speeddata v60:=[60,500,5000,1000];
CONST speeddata v80:=[80,500,5000,1000];
CONST speeddata v100:=[100,500,5000,1000];
CONST speeddata v150:=[150,500,5000,1000];
CONST speeddata v200:=[200,500,5000,1000];
CONST speeddata v300:=[300,500,5000,1000];
CONST speeddata v400:=[400,500,5000,1000];
CONST speeddata v500:=[500,500,5000,1000];
CONST speeddata v600:=[600,500,5000,1000];
CONST speeddata v800:=[800,500,5000,1000];
CONST speeddata v1000:=[1000,500,5000,1000];
CONST speeddata v1500:=[1500,500,5000,1000];
CONST speeddata v2000:=[2000,500,5000,1000];
CONST speeddata v2500:=[2500,500,5000,1000];
CONST speeddata v3000:=[3000,500,5000,1000];
CONST speeddata v4000:=[4000,500,5000,1000];
CONST speeddata v5000:=[5000,500,5000,1000];
CONST speeddata v6000:=[6000,500,5000,1000];
CONST speeddata v7000:=[7000,500,5000,1000];
CONST speeddata vmax;
CONST speeddata vrot1;
CONST speeddata vrot2;
CONST speeddata vrot5;
CONST speeddata vrot10;
CONST speeddata vrot20;
CONST speeddata vrot50;
CONST speeddata vrot100;
CONST speeddata vlin10;
CONST speeddata vlin20;
CONST speeddata vlin50;
CONST speeddata vlin100;
CONST speeddata vlin200;
CONST speeddata vlin500;
CONST speeddata vlin1000;
CONST stoppointdata inpos20;
CONST stoppointdata inpos50;
CONST stoppointdata inpos100;
CONST stoppointdata stoptime0_5;
CONST stoppointdata stoptime1_0;
CONST stoppointdata stoptime1_5;
CONST stoppointdata fllwtime0_5;
CONST stoppointdata fllwtime1_0;
CONST stoppointdata fllwtime1_5;
CONST stoppoint inpos;
CONST stoppoint stoptime;
CONST stoppoint fllwtime;
CONST num pi:=3.141592654;
CONST string STR_DIGIT;
CONST string STR_LOWER;
CONST string STR_UPPER;
CONST string STR_WHITE;
CONST string flp1;
CONST string diskhome;
CONST string diskram;
CONST string disktemp;
CONST string usbdisk1;
CONST string usbdisk2;
CONST string usbdisk3;
CONST string usbdisk4;
CONST string usbdisk5;
CONST string usbdisk6;
CONST string usbdisk7;
CONST string usbdisk8;
CONST string usbdisk9;
CONST string usbdisk10;
CONST string stEmpty:="";
CONST dionum high:=1;
CONST dionum low:=0;
CONST dionum edge:=2;
CONST mecunit ROB_1;
CONST num WAIT_MAX;
CONST num EOF_BIN:=-1;
CONST num EOF_NUM;
CONST string EOF;
CONST num END_OF_LIST;
PERS tooldata tool0;
PERS wobjdata wobj0;
PERS loaddata load0;
VAR num reg1;
VAR num reg2;
VAR num reg3;
VAR num reg4;
VAR num reg5;
VAR clock clock1;
VAR errnum ERRNO;
VAR intnum INTNO;
CONST errnum ERR_ACC_TOO_LOW;
CONST errnum ERR_ACTIV_PROF;
CONST errnum ERR_ADDR_INUSE;
CONST errnum ERR_ALIASIO_DEF;
CONST errnum ERR_ALIASIO_TYPE;
CONST errnum ERR_ALRDYCNT;
CONST errnum ERR_ALRDY_MOVING;
CONST errnum ERR_AO_LIM;
CONST errnum ERR_ARGDUPCND;
CONST errnum ERR_ARGNAME;
CONST errnum ERR_ARGNOTPER;
CONST errnum ERR_ARGNOTVAR;
CONST errnum ERR_ARGVALERR;
CONST errnum ERR_ARRAY_SIZE;
CONST errnum ERR_AXIS_ACT;
CONST errnum ERR_AXIS_IND;
CONST errnum ERR_AXIS_MOVING;
CONST errnum ERR_AXIS_PAR;
CONST errnum ERR_BUSSTATE;
CONST errnum ERR_BWDLIMIT;
CONST errnum ERR_CALC_DIVZERO;
CONST errnum ERR_CALC_NEG;
CONST errnum ERR_CALC_OVERFLOW;
CONST errnum ERR_CALLIO_INTER;
CONST errnum ERR_CALLPROC;
CONST errnum ERR_CAM_BUSY;
CONST errnum ERR_CAM_COM_TIMEOUT;
CONST errnum ERR_CAM_GET_MISMATCH;
CONST errnum ERR_CAM_MAXTIME;
CONST errnum ERR_CAM_NO_MORE_DATA;
CONST errnum ERR_CAM_NO_PROGMODE;
CONST errnum ERR_CAM_NO_RUNMODE;
CONST errnum ERR_CAM_SET_MISMATCH;
CONST errnum ERR_CFG_ILLTYPE;
CONST cfgdomain ERR_CFG_ILL_DOMAIN;
CONST errnum ERR_CFG_INTERNAL;
CONST errnum ERR_CFG_LIMIT;
CONST errnum ERR_CFG_NOTFND;
CONST errnum ERR_CFG_OUTOFBOUNDS;
CONST errnum ERR_CFG_WRITEFILE;
CONST errnum ERR_CNTNOTVAR;
CONST errnum ERR_CNV_CONNECT;
CONST errnum ERR_CNV_DROPPED;
CONST errnum ERR_CNV_NOT_ACT;
CONST errnum ERR_COLL_STOP;
CONST errnum ERR_COMM_EXT;
CONST errnum ERR_COMM_INIT;
CONST errnum ERR_COMM_INIT_FAILED;
CONST errnum ERR_CONC_MAX;
CONST errnum ERR_CONTACTL;
CONST errnum ERR_CSV_INDEX;
CONST errnum ERR_DA_UNKPROC;
CONST errnum ERR_DATA_RECV;
CONST errnum ERR_DEV_MAXTIME;
CONST errnum ERR_DIPLAG_LIM;
CONST errnum ERR_DIVZERO;
CONST errnum ERR_DROP_LOAD;
CONST errnum ERR_EXCRTYMAX;
CONST errnum ERR_EXECPHR;
CONST errnum ERR_FILEACC;
CONST errnum ERR_FILEEXIST;
CONST errnum ERR_FILEOPEN;
CONST errnum ERR_FILESIZE;
CONST errnum ERR_FILNOTFND;
CONST errnum ERR_FNCNORET;
CONST errnum ERR_FRAME;
CONST errnum ERR_FRICTUNE_FATAL;
CONST errnum ERR_GLUEFLOW;
CONST errnum ERR_GO_LIM;
CONST errnum ERR_HAND_FAILEDGRIPPOS;
CONST errnum ERR_HAND_FAILEDMOVEPOS;
CONST errnum ERR_HAND_FAILEDVACUUM;
CONST errnum ERR_HAND_NOTCALIBRATED;
CONST errnum ERR_ILLDIM;
CONST errnum ERR_ILLQUAT;
CONST errnum ERR_ILLRAISE;
CONST errnum ERR_INDCNV_ORDER;
CONST errnum ERR_INOISSAFE;
CONST errnum ERR_INOMAX;
CONST errnum ERR_INPAR_RDONLY;
CONST errnum ERR_INT_MAXVAL;
CONST errnum ERR_INT_NOTVAL;
CONST errnum ERR_INVDIM;
CONST errnum ERR_IODISABLE;
CONST errnum ERR_IODN_TIMEOUT;
CONST errnum ERR_IOENABLE;
CONST errnum ERR_IOERROR;
CONST errnum ERR_IPSDEVICE_UNKNOWN;
CONST errnum ERR_IPSILLEGAL_CH_OR_FAC;
CONST errnum ERR_IPS_PARAM;
CONST errnum ERR_ITMSRC_UNDEF;
CONST errnum ERR_LINKREF;
CONST errnum ERR_LOADED;
CONST errnum ERR_LOADID_FATAL;
CONST errnum ERR_LOADID_RETRY;
CONST errnum ERR_LOADNO_INUSE;
CONST errnum ERR_LOADNO_NOUSE;
CONST errnum ERR_MSG_PENDING;
CONST errnum ERR_MAXINTVAL;
CONST errnum ERR_MOC_CNV_REC_FILE_UNKNOWN;
CONST errnum ERR_MODULE;
CONST errnum ERR_MOD_NOT_LOADED;
CONST errnum ERR_MOD_NOTLOADED;
CONST errnum ERR_MT_ABORT;
CONST errnum ERR_MT_HOME;
CONST errnum ERR_MT_HOMERUN;
CONST errnum ERR_NEGARG;
CONST errnum ERR_NAME_INVALID;
CONST errnum ERR_NORUNUNIT;
CONST errnum ERR_NOTARR;
CONST errnum ERR_NOTEQDIM;
CONST errnum ERR_NOTINTVAL;
CONST errnum ERR_NOTPRES;
CONST errnum ERR_NOTSAVED;
CONST errnum ERR_NOT_MOVETASK;
CONST errnum ERR_NO_ALIASIO_DEF;
CONST errnum ERR_NO_SGUN;
CONST errnum ERR_NUM_LIMIT;
CONST errnum ERR_OUTOFBND;
CONST errnum ERR_OUTSIDE_REACH;
CONST errnum ERR_OVERFLOW;
CONST errnum ERR_PATH;
CONST errnum ERR_PATHDIST;
CONST errnum ERR_PATH_STOP;
CONST errnum ERR_PERSSUPSEARCH;
CONST errnum ERR_PID_MOVESTOP;
CONST errnum ERR_PID_RAISE_PP;
CONST errnum ERR_PPA_TIMEOUT;
CONST errnum ERR_PRGMEMFULL;
CONST errnum ERR_PROCSIGNAL_OFF;
CONST errnum ERR_PROGSTOP;
CONST errnum ERR_RANYBIN_CHK;
CONST errnum ERR_RANYBIN_EOF;
CONST errnum ERR_RCVDATA;
CONST errnum ERR_REFUNKDAT;
CONST errnum ERR_REFUNKFUN;
CONST errnum ERR_REFUNKPRC;
CONST errnum ERR_REFUNKTRP;
CONST errnum ERR_RMQ_DIM;
CONST errnum ERR_RMQ_FULL;
CONST errnum ERR_RMQ_INVALID;
CONST errnum ERR_RMQ_INVMSG;
CONST errnum ERR_RMQ_MSGSIZE;
CONST errnum ERR_RMQ_NAME;
CONST errnum ERR_RMQ_NOMSG;
CONST errnum ERR_RMQ_TIMEOUT;
CONST errnum ERR_RMQ_VALUE;
CONST errnum ERR_ROBLIMIT;
CONST errnum ERR_SC_WRITE;
CONST errnum ERR_SGUN_ESTOP;
CONST errnum ERR_SGUN_MOTOFF;
CONST errnum ERR_SGUN_NEGVAL;
CONST errnum ERR_SGUN_NOTACT;
CONST errnum ERR_SGUN_NOTINIT;
CONST errnum ERR_SGUN_NOTOPEN;
CONST errnum ERR_SGUN_NOTSYNC;
CONST errnum ERR_SIG_NAME;
CONST errnum ERR_SIGSUPSEARCH;
CONST errnum ERR_SIG_NOT_VALID;
CONST errnum ERR_SOCK_ADDR_INVALID;
CONST errnum ERR_SOCK_ADDR_INUSE;
CONST errnum ERR_SOCK_CLOSED;
CONST errnum ERR_SOCK_IS_BOUND;
CONST errnum ERR_SOCK_IS_CONN;
CONST errnum ERR_SOCK_NET_UNREACH;
CONST errnum ERR_SOCK_NOT_BOUND;
CONST errnum ERR_SOCK_NOT_CONN;
CONST errnum ERR_SOCK_TIMEOUT;
CONST errnum ERR_SOCK_UNSPEC;
CONST errnum ERR_SPEEDLIM_VALUE;
CONST errnum ERR_SPEED_REFRESH_LIM;
CONST errnum ERR_STARTMOVE;
CONST errnum ERR_STORE_PROF;
CONST errnum ERR_STRTOOLNG;
CONST errnum ERR_SYMBOL_TYPE;
CONST errnum ERR_SYM_ACCESS;
CONST errnum ERR_SYNCMOVEOFF;
CONST errnum ERR_SYNCMOVEON;
CONST errnum ERR_SYNTAX;
CONST errnum ERR_TASKNAME;
CONST errnum ERR_TP_DIBREAK;
CONST errnum ERR_TP_DOBREAK;
CONST errnum ERR_TP_MAXTIME;
CONST errnum ERR_TP_NO_CLIENT;
CONST errnum ERR_TP_PERSBOOLBREAK;
CONST errnum ERR_TRUSTLEVEL;
CONST errnum ERR_TXTNOEXIST;
CONST errnum ERR_UDPUC_COMM;
CONST errnum ERR_UISHOW_FATAL;
CONST errnum ERR_UISHOW_FULL;
CONST errnum ERR_UI_INITVALUE;
CONST errnum ERR_UI_MAXMIN;
CONST errnum ERR_UI_NOTINT;
CONST errnum ERR_UNIT_PAR;
CONST errnum ERR_UNKINO;
CONST errnum ERR_UNKPROC;
CONST errnum ERR_UNLOAD;
CONST errnum ERR_USE_PROF;
CONST errnum ERR_WAITSYNCTASK;
CONST errnum ERR_WAIT_MAX;
CONST errnum ERR_WAIT_MAXTIME;
CONST errnum ERR_WHL_SEARCH;
CONST errnum ERR_WHLSEARCH;
CONST errnum ERR_WOBJ_MOVING;
CONST errnum CORR_NOFREE;
CONST errnum CORR_NOOBJECT;
CONST errnum CORR_NOTCONN;
CONST errnum SEN_BUSY;
CONST errnum SEN_CAALARM;
CONST errnum SEN_CAMCHECK;
CONST errnum SEN_EXALARM;
CONST errnum SEN_GENERRO;
CONST errnum SEN_NO_MEAS;
CONST errnum SEN_NOREADY;
CONST errnum SEN_TEMP;
CONST errnum SEN_TIMEOUT;
CONST errnum SEN_UNKNOWN;
CONST errnum SEN_VALUE;
CONST errnum SYS_ERR_ARL_INPAR_RDONLY;
CONST errnum SYS_ERR_MOC_CNV_REC_FILE_UNKNOWN;
CONST errnum SYS_ERR_MOC_CNV_REC_NOT_READY;
CONST egmframetype EGM_FRAME_BASE;
CONST egmframetype EGM_FRAME_TOOL;
CONST egmframetype EGM_FRAME_WOBJ;
CONST egmframetype EGM_FRAME_WORLD;
CONST egmframetype EGM_FRAME_JOINT;
CONST egmstate EGM_STATE_DISCONNECTED;
CONST egmstate EGM_STATE_CONNECTED;
CONST egmstate EGM_STATE_RUNNING;
CONST egmstopmode EGM_STOP_HOLD;
CONST egmstopmode EGM_STOP_RAMP_DOWN;
CONST inttypes USINT;
CONST inttypes UINT;
CONST inttypes UDINT;
CONST inttypes ULINT;
CONST inttypes SINT;
CONST inttypes INT;
CONST inttypes DINT;
CONST inttypes LINT;
CONST opcalc OpAdd;
CONST opcalc OpSub;
CONST opcalc OpMult;
CONST opcalc OpDiv;
CONST opcalc OpMod;
CONST triggmode TRIGG_MODE1;
CONST triggmode TRIGG_MODE2;
CONST triggmode TRIGG_MODE3;
CONST tunetype TUNE_DF;
CONST tunetype TUNE_KP;
CONST tunetype TUNE_KV;
CONST tunetype TUNE_TI;
CONST tunetype TUNE_FRIC_LEV;
CONST tunetype TUNE_FRIC_RAMP;
CONST tunetype TUNE_DG;
CONST tunetype TUNE_DH;
CONST tunetype TUNE_DI;
CONST tunetype TUNE_DK;
CONST tunetype TUNE_DL;
CONST symnum OP_NO_ROBOT;
CONST symnum OP_SERVICE;
CONST symnum OP_PRODUCTION;
CONST tpnum TP_LATEST;
CONST tpnum TP_PROGRAM;
CONST tpnum TP_SCREENVIEWER;
CONST signalorigin SIGORIG_NONE;
CONST signalorigin SIGORIG_CFG;
CONST signalorigin SIGORIG_ALIAS;
CONST aiotrigg AIO_ABOVE_HIGH;
CONST aiotrigg AIO_BELOW_HIGH;
CONST aiotrigg AIO_ABOVE_LOW;
CONST aiotrigg AIO_BELOW_LOW;
CONST aiotrigg AIO_BETWEEN;
CONST aiotrigg AIO_OUTSIDE;
CONST aiotrigg AIO_ALWAYS;
CONST socketstatus SOCKET_CREATED;
CONST socketstatus SOCKET_CONNECTED;
CONST socketstatus SOCKET_BOUND;
CONST socketstatus SOCKET_LISTENING;
CONST socketstatus SOCKET_CLOSED;
CONST symnum OP_UNDEF;
CONST symnum OP_AUTO;
CONST symnum OP_MAN_PROG;
CONST symnum OP_MAN_TEST;
CONST symnum RUN_UNDEF;
CONST symnum RUN_CONT_CYCLE;
CONST symnum RUN_INSTR_FWD;
CONST symnum RUN_INSTR_BWD;
CONST symnum RUN_SIM;
CONST symnum RUN_STEP_MOVE;
CONST event_type EVENT_NONE;
CONST event_type EVENT_POWERON;
CONST event_type EVENT_START;
CONST event_type EVENT_STOP;
CONST event_type EVENT_QSTOP;
CONST event_type EVENT_RESTART;
CONST event_type EVENT_RESET;
CONST event_type EVENT_STEP;
CONST handler_type HANDLER_NONE;
CONST handler_type HANDLER_BWD;
CONST handler_type HANDLER_ERR;
CONST handler_type HANDLER_UNDO;
CONST exec_level LEVEL_NORMAL;
CONST exec_level LEVEL_TRAP;
CONST exec_level LEVEL_SERVICE;
CONST opnum LT;
CONST opnum LTEQ;
CONST opnum EQ;
CONST opnum NOTEQ;
CONST opnum GT;
CONST opnum GTEQ;
CONST icondata iconNone;
CONST icondata iconInfo;
CONST icondata iconWarning;
CONST icondata iconError;
CONST buttondata btnNone;
CONST buttondata btnOK;
CONST buttondata btnAbrtRtryIgn;
CONST buttondata btnOKCancel;
CONST buttondata btnRetryCancel;
CONST buttondata btnYesNo;
CONST buttondata btnYesNoCancel;
CONST btnres resUnkwn;
CONST btnres resOK;
CONST btnres resAbort;
CONST btnres resRetry;
CONST btnres resIgnore;
CONST btnres resCancel;
CONST btnres resYes;
CONST btnres resNo;
CONST cfgdomain ALL_DOMAINS;
CONST cfgdomain EIO_DOMAIN;
CONST cfgdomain MMC_DOMAIN;
CONST cfgdomain MOC_DOMAIN;
CONST cfgdomain PROC_DOMAIN;
CONST cfgdomain SIO_DOMAIN;
CONST cfgdomain SYS_DOMAIN;
CONST errdomain COMMON_ERR;
CONST errdomain OP_STATE;
CONST errdomain SYSTEM_ERR;
CONST errdomain HARDWARE_ERR;
CONST errdomain PROGRAM_ERR;
CONST errdomain MOTION_ERR;
CONST errdomain OPERATOR_ERR;
CONST errdomain IO_COM_ERR;
CONST errdomain USER_DEF_ERR;
CONST errdomain SAFETY_ERR;
CONST errdomain PROCESS_ERR;
CONST errdomain CFG_ERR;
CONST errtype TYPE_ALL;
CONST errtype TYPE_ERR;
CONST errtype TYPE_STATE;
CONST errtype TYPE_WARN;
CONST iounit_state IOUNIT_LOG_STATE_DISABLED;
CONST iounit_state IOUNIT_LOG_STATE_ENABLED;
CONST iounit_state IOUNIT_PHYS_STATE_DEACTIVATED;
CONST iounit_state IOUNIT_PHYS_STATE_RUNNING;
CONST iounit_state IOUNIT_PHYS_STATE_ERROR;
CONST iounit_state IOUNIT_PHYS_STATE_UNCONNECTED;
CONST iounit_state IOUNIT_PHYS_STATE_UNCONFIGURED;
CONST iounit_state IOUNIT_PHYS_STATE_STARTUP;
CONST iounit_state IOUNIT_PHYS_STATE_INIT;
CONST iounit_state IOUNIT_RUNNING;
CONST iounit_state IOUNIT_RUNERROR;
CONST iounit_state IOUNIT_DISABLE;
CONST iounit_state IOUNIT_OTHERERR;
CONST busstate BUSSTATE_ERROR;
CONST busstate BUSSTATE_HALTED;
CONST busstate BUSSTATE_INIT;
CONST busstate BUSSTATE_RUN;
CONST busstate BUSSTATE_STARTUP;
CONST tsp_status TSP_STATUS_NOT_NORMAL_TASK;
CONST tsp_status TSP_STATUS_DEACT;
CONST tsp_status TSP_STATUS_DEACT_SERV_ROUT;
CONST tsp_status TSP_STATUS_ACT;
CONST tsp_status TSP_UNCHECKED_RUN_SERV_ROUT;
CONST tsp_status TSP_NORMAL_UNCHECKED;
CONST tsp_status TSP_STATIC_UNCHECKED;
CONST tsp_status TSP_SEMISTATIC_UNCHECKED;
CONST tsp_status TSP_NORMAL_CHECKED;
CONST tsp_status TSP_STATIC_CHECKED;
CONST tsp_status TSP_SEMISTATIC_CHECKED;
CONST errnum ERR_MYDIVZERO;
CONST errnum ERR_MY_ERR;
FUNC num Abs(num Value) ENDFUNC
FUNC dnum AbsDnum(dnum Value) ENDFUNC
PROC AccSet(num Acc, num Ramp \num FinePointRamp) ENDPROC
FUNC num ACos(num Value) ENDFUNC
FUNC dnum ACosDnum(dnum Value) ENDFUNC
PROC ActEventBuffer() ENDPROC
PROC ActUnit(VAR mecunit MechUnit) ENDPROC
PROC Add(INOUT num Name | INOUT dnum Dname, num AddValue | dnum AddDvalue) ENDPROC
FUNC num AInput(VAR signalai Signal) ENDFUNC
PROC AliasCamera(string CameraName | VAR cameradev FromCamera, VAR cameradev ToCamera) ENDPROC
PROC AliasIO(anytype FromSignal, VAR anytype ToSignal) ENDPROC
PROC AliasIOReset(VAR anytype Signal) ENDPROC
FUNC num AOutput(VAR signalao Signal) ENDFUNC
FUNC string ArgName(anytype Parameter) ENDFUNC
FUNC num ASin(num Value) ENDFUNC
FUNC dnum ASinDnum(dnum Value) ENDFUNC
FUNC num ATan(num Value) ENDFUNC
FUNC num ATan2(num Y, num X) ENDFUNC
FUNC dnum ATan2Dnum(dnum Y, dnum X) ENDFUNC
FUNC dnum ATanDnum(dnum Value) ENDFUNC
FUNC byte BitAnd(byte BitData1, byte BitData2) ENDFUNC
FUNC dnum BitAndDnum(dnum Value1, dnum Value2) ENDFUNC
FUNC bool BitCheck(byte BitData, num BitPos) ENDFUNC
FUNC bool BitCheckDnum(dnum Value, num BitPos) ENDFUNC
PROC BitClear(INOUT byte BitData | INOUT dnum DnumData, num BitPos) ENDPROC
FUNC byte BitLSh(byte BitData, num ShiftSteps) ENDFUNC
FUNC dnum BitLShDnum(dnum Value, num ShiftSteps \num Size) ENDFUNC
FUNC byte BitNeg(byte BitData) ENDFUNC
FUNC dnum BitNegDnum(dnum Value \num Size) ENDFUNC
FUNC byte BitOr(byte BitData1, byte BitData2) ENDFUNC
FUNC dnum BitOrDnum(dnum Value1, dnum Value2) ENDFUNC
FUNC byte BitRSh(byte BitData, num ShiftSteps) ENDFUNC
FUNC dnum BitRShDnum(dnum Value, num ShiftSteps) ENDFUNC
PROC BitSet(INOUT byte BitData | INOUT dnum DnumData, num BitPos) ENDPROC
FUNC byte BitXOr(byte BitData1, byte BitData2) ENDFUNC
FUNC dnum BitXOrDnum(dnum Value1, dnum Value2) ENDFUNC
PROC BookErrNo(VAR errnum ErrorName) ENDPROC
PROC Break() ENDPROC
FUNC string ByteToStr(byte BitData \switch Hex | \switch Okt | \switch Bin | \switch Char) ENDFUNC
FUNC jointtarget CalcJointT(\switch UseCurWObjPos, robtarget Rob_target, PERS tooldata Tool \PERS wobjdata WObj \INOUT errnum ErrorNumber) ENDFUNC
FUNC robtarget CalcRobT(jointtarget Joint_target, PERS tooldata Tool \PERS wobjdata WObj) ENDFUNC
FUNC pose CalcRotAxFrameZ(robtarget TargetList{*}, num TargetsInList, robtarget PositiveZPoint, VAR num MaxErr, VAR num MeanErr) ENDFUNC
FUNC pose CalcRotAxisFrame(VAR mecunit MechUnit \num AxisNo, robtarget TargetList{*}, num TargetsInList, VAR num MaxErr, VAR num MeanErr) ENDFUNC
PROC CallByVar(string Name, num Number) ENDPROC
PROC CamFlush(VAR cameradev Camera) ENDPROC
FUNC num CamGetExposure(VAR cameradev Camera \switch ExposureTime | \switch Brightness | \switch Contrast) ENDFUNC
FUNC string CamGetLoadedJob(VAR cameradev Camera) ENDFUNC
FUNC string CamGetName(VAR cameradev Camera) ENDFUNC
PROC CamGetParameter(VAR cameradev Camera, string ParName \VAR num NumVar | \VAR bool BoolVar | \VAR string StrVar) ENDPROC
PROC CamGetResult(VAR cameradev Camera, VAR cameratarget CamTarget \num SceneId \num MaxTime) ENDPROC
PROC CamLoadJob(VAR cameradev Camera, string JobName \switch KeepTargets \num MaxTime) ENDPROC
FUNC num CamNumberOfResults(VAR cameradev Camera \num SceneId) ENDFUNC
PROC CamReqImage(VAR cameradev Camera \VAR num SceneId \switch KeepTargets \switch AwaitComplete) ENDPROC
PROC CamSetExposure(VAR cameradev Camera \num ExposureTime \num Brightness \num Contrast) ENDPROC
PROC CamSetParameter(VAR cameradev Camera, string ParName \num NumVal | \bool BoolVal | \string StrVal) ENDPROC
PROC CamSetProgramMode(VAR cameradev Camera) ENDPROC
PROC CamSetRunMode(VAR cameradev Camera) ENDPROC
PROC CamStartLoadJob(VAR cameradev Camera, string Name \switch KeepTargets) ENDPROC
PROC CancelLoad(VAR loadsession LoadNo) ENDPROC
PROC CapCondSetDO(VAR signaldo Signal, dionum Value) ENDPROC
PROC CapEquiDist(\num Distance \switch Reset) ENDPROC
FUNC bool CapGetFailSigs(INOUT string ErrorNames) ENDFUNC
PROC CapNoProcess(num skip_dist) ENDPROC
PROC CapRefresh(\switch MainSpeed \switch MainWeave \bool Startweave \num RestartDist) ENDPROC
PROC CapWeaveSync(\switch Reset, signaldo DoLeft, num LevelLeft, signaldo DoRight, num LevelRight) ENDPROC
FUNC string CDate() ENDFUNC
PROC CheckProgRef() ENDPROC
PROC CirPathMode(\switch PathFrame | \switch ObjectFrame | \switch CirPointOri | \switch Wrist45 | \switch Wrist46 | \switch Wrist56) ENDPROC
FUNC jointtarget CJointT(\VAR taskid TaskRef | \string TaskName) ENDFUNC
PROC Clear(INOUT num Name | INOUT dnum Dname) ENDPROC
PROC ClearIOBuff(VAR iodev IODevice) ENDPROC
PROC ClearPath() ENDPROC
PROC ClearRawBytes(VAR rawbytes RawData \num FromIndex) ENDPROC
FUNC num ClkRead(VAR clock Clock \switch HighRes) ENDFUNC
PROC ClkReset(VAR clock Clock) ENDPROC
PROC ClkStart(VAR clock Clock) ENDPROC
PROC ClkStop(VAR clock Clock) ENDPROC
PROC Close(VAR iodev IODevice) ENDPROC
PROC CloseDir(VAR dir Dev) ENDPROC
PROC ConfJ(\switch On | \switch Off) ENDPROC
PROC ConfL(\switch On | \switch Off) ENDPROC
PROC ContactL(\switch DesiredTorque, robtarget ToPoint \identno ID, speeddata Speed \zonedata Zone, PERS tooldata Tool \PERS wobjdata WObj) ENDPROC
PROC CopyFile(string OldPath, string NewPath) ENDPROC
PROC CopyRawBytes(VAR rawbytes FromRawData, num FromIndex, VAR rawbytes ToRawData, num ToIndex \num NoOfBytes) ENDPROC
PROC CorrClear() ENDPROC
PROC CorrCon(VAR corrdescr Descr) ENDPROC
PROC CorrDiscon(VAR corrdescr Descr) ENDPROC
FUNC pos CorrRead() ENDFUNC
PROC CorrWrite(VAR corrdescr Descr, pos Data) ENDPROC
FUNC num Cos(num Angle) ENDFUNC
FUNC dnum CosDnum(dnum Angle) ENDFUNC
FUNC pos CPos(\PERS tooldata Tool \PERS wobjdata WObj) ENDFUNC
FUNC robtarget CRobT(\VAR taskid TaskRef | \string TaskName \PERS tooldata Tool \PERS wobjdata WObj) ENDFUNC
FUNC num CSpeedOverride(\switch CTask) ENDFUNC
FUNC string CTime() ENDFUNC
FUNC tooldata CTool(\VAR taskid TaskRef | \string TaskName) ENDFUNC
FUNC wobjdata CWObj(\VAR taskid TaskRef | \string TaskName) ENDFUNC
PROC DeactEventBuffer() ENDPROC
PROC DeactUnit(VAR mecunit MechUnit) ENDPROC
PROC Decr(INOUT num Name | INOUT dnum Dname) ENDPROC
FUNC string DecToHex(string Str) ENDFUNC
FUNC pose DefAccFrame(robtarget TargetListOne{*}, robtarget TargetListTwo{*}, num TargetsInList, VAR num MaxErr, VAR num MeanErr) ENDFUNC
FUNC pose DefDFrame(robtarget OldP1, robtarget OldP2, robtarget OldP3, robtarget NewP1, robtarget NewP2, robtarget NewP3) ENDFUNC
FUNC pose DefFrame(robtarget NewP1, robtarget NewP2, robtarget NewP3 \num Origin) ENDFUNC
FUNC num Dim(anytype ArrPar, num DimNo) ENDFUNC
FUNC dionum DInput(VAR signaldi Signal) ENDFUNC
FUNC num Distance(pos Point1, pos Point2) ENDFUNC
FUNC num DnumToNum(dnum Value \switch Integer) ENDFUNC
FUNC string DnumToStr(dnum Val, num Dec \switch Exp) ENDFUNC
FUNC num DotProd(pos Vector1, pos Vector2) ENDFUNC
FUNC dionum DOutput(VAR signaldo Signal) ENDFUNC
PROC DropSensor(VAR mecunit MechUnit) ENDPROC
PROC DropWObj(PERS wobjdata WObj) ENDPROC
PROC EGMGetId(VAR egmident EGMid) ENDPROC
FUNC egmstate EGMGetState(VAR egmident EGMid) ENDFUNC
PROC EGMMoveC(VAR egmident GMid, robtarget CirPoint, robtarget ToPoint, speeddata Speed, zonedata Zone, PERS tooldata Tool \PERS wobjdata WObj \PERS loaddata TLoad \switch NoCorr) ENDPROC
PROC EGMMoveL(VAR egmident EGMid, robtarget ToPoint, speeddata Speed, zonedata Zone, PERS tooldata Tool \PERS wobjdata WObj \PERS loaddata TLoad \switch NoCorr) ENDPROC
PROC EGMReset(VAR egmident EGMid) ENDPROC
PROC EGMSetupLTAPP(VAR mecunit MecUnit, VAR egmident EGMid, string ExtConfigName, string Device, num JointType \switch APTR | \switch LATR) ENDPROC
PROC EGMSetupUC(VAR mecunit MecUnit, VAR egmident EGMid, string ExtConfigName, string UCDevice \switch Joint | \switch Pose | \switch PathCorr \switch APTR | \switch LATR \num CommTimeout) ENDPROC
PROC EGMStop(VAR egmident EGMid, egmstopmode Mode \num RampOutTime) ENDPROC
PROC EOffsOff() ENDPROC
PROC EOffsOn(\robtarget ExeP, robtarget ProgPoint) ENDPROC
PROC EOffsSet(extjoint EAxOffs) ENDPROC
PROC EraseModule(string ModuleName) ENDPROC
PROC ErrLog(num ErrorId \switch W | \switch I, errstr Argument1, errstr Argument2, errstr Argument3, errstr Argument4, errstr Argument5) ENDPROC
PROC ErrRaise(string ErrorName, num ErrorId, errstr Argument1, errstr Argument2, errstr Argument3, errstr Argument4, errstr Argument5) ENDPROC
PROC ErrWrite(\switch W | \switch I, string Header, string Reason \string RL2 \string RL3 \string RL4) ENDPROC
FUNC num EulerZYX(\switch X | \switch Y | \switch Z, orient Rotation) ENDFUNC
FUNC event_type EventType() ENDFUNC
FUNC handler_type ExecHandler() ENDFUNC
FUNC exec_level ExecLevel() ENDFUNC
PROC ExitCycle() ENDPROC
FUNC num Exp(num Exponent) ENDFUNC
FUNC num FileSize(string Path) ENDFUNC
FUNC dnum FileTimeDnum(string Path \switch ModifyTime | \switch AccessTime | \switch StatCTime \VAR stringdig StrDig) ENDFUNC
PROC FricIdEvaluate(PERS num FricLevels{*} \VAR mecunit MechUnit \speeddata BwdSpeed \switch NoPrint \VAR num FricLevelMax \VAR num FricLevelMin \VAR num OptTolerance) ENDPROC
PROC FricIdInit() ENDPROC
PROC FricIdSetFricLevels(num FricLevels{*} \VAR mecunit MechUnit) ENDPROC
FUNC num FSSize(string Name \switch Total | \switch Free \switch Kbyte \switch Mbyte) ENDFUNC
FUNC dnum GetAxisMoveTime(VAR mecunit MechUnit, VAR num AxisNo) ENDFUNC
PROC GetDataVal(string Object \VAR datapos Block | \VAR taskid TaskRef | \string TaskName, VAR anytype Value) ENDPROC
PROC GetJointData(\VAR mecunit MechUnit, num Axis \VAR num Position \VAR num Speed \VAR num Torque \VAR num ExtTorque) ENDPROC
FUNC num GetMaxNumberOfCyclicBool() ENDFUNC
FUNC string GetMecUnitName(VAR mecunit MechUnit) ENDFUNC
FUNC num GetMotorTorque(\VAR mecunit MecUnit, num AxisNo) ENDFUNC
FUNC bool GetNextCyclicBool(VAR num ListNumber, VAR string Name) ENDFUNC
FUNC bool GetNextSym(INOUT string Object, VAR datapos Block \switch Recursive) ENDFUNC
FUNC num GetNumberOfCyclicBool() ENDFUNC
FUNC string GetServiceInfo(VAR mecunit MechUnit \switch DutyTimeCnt) ENDFUNC
PROC GetSysData(\VAR taskid TaskRef | \string TaskName, PERS anytype DestObject \INOUT string ObjectName) ENDPROC
FUNC string GetSysInfo(\switch SerialNo | \switch SWVersion | \switch SWVersionName | \switch RobotType | \switch CtrlId | \switch LanIp | \switch CtrlLang | \switch SystemName) ENDFUNC
FUNC string GetTaskName(\VAR num TaskNo \VAR num MecTaskNo) ENDFUNC
FUNC num GetTime(\switch WDay | \switch Hour | \switch Min | \switch Sec) ENDFUNC
PROC GetTrapData(VAR trapdata TrapEvent) ENDPROC
FUNC tsp_status GetTSPStatus(VAR taskid TaskRef | string TaskName) ENDFUNC
FUNC num GInput(VAR signalgi Signal) ENDFUNC
FUNC dnum GInputDnum(VAR signalgi Signal) ENDFUNC
FUNC num GOutput(VAR signalgo Signal) ENDFUNC
FUNC dnum GOutputDnum(VAR signalgo Signal) ENDFUNC
PROC GripLoad(PERS loaddata Load) ENDPROC
FUNC string HexToDec(string Str) ENDFUNC
PROC HollowWristReset() ENDPROC
PROC ICap(intnum Interrupt, num Event) ENDPROC
PROC IDelete(VAR intnum Interrupt) ENDPROC
PROC IDisable() ENDPROC
PROC IEnable() ENDPROC
PROC IError(errdomain ErrorDomain \num ErrorId, errtype ErrorType, VAR intnum Interrupt) ENDPROC
PROC Incr(INOUT num Name | INOUT dnum Dname) ENDPROC
PROC IndAMove(VAR mecunit MecUnit, num Axis \robtarget ToAbsPos | \num ToAbsNum, num Speed \num Ramp) ENDPROC
PROC IndCMove(VAR mecunit MecUnit, num Axis, num Speed \num Ramp) ENDPROC
FUNC bool IndInpos(VAR mecunit MecUnit, num Axis) ENDFUNC
PROC IndReset(VAR mecunit MecUnit, num Axis \robtarget RefPos | \num RefNum \switch Short | \switch Fwd | \switch Bwd | \switch Old) ENDPROC
PROC IndRMove(VAR mecunit MecUnit, num Axis \robtarget ToRelPos | \num ToRelNum \switch Short | \switch Fwd | \switch Bwd, num Speed \num Ramp) ENDPROC
FUNC bool IndSpeed(VAR mecunit MecUnit, num Axis \switch InSpeed | \switch ZeroSpeed) ENDFUNC
PROC InitSuperv() ENDPROC
PROC InvertDO(VAR signaldo Signal) ENDPROC
PROC IOBusStart(string BusName) ENDPROC
PROC IOBusState(string BusName, VAR busstate State \switch Phys | \switch Logic) ENDPROC
PROC IODisable(string UnitName, num MaxTime) ENDPROC
PROC IOEnable(string UnitName, num MaxTime) ENDPROC
FUNC iounit_state IOUnitState(string UnitName \switch Phys | \switch Logic) ENDFUNC
PROC IPers(\switch Single | \switch SingleSafe, PERS anytype Name, VAR intnum Interrupt) ENDPROC
PROC IRMQMessage(anytype InterruptDataType, VAR intnum Interrupt) ENDPROC
FUNC bool IsBrakeCheckActive() ENDFUNC
FUNC bool IsCyclicBool(PERS bool Flag | string Name \VAR taskid TaskRef | \string TaskName) ENDFUNC
FUNC bool IsFile(string Path \switch Directory \switch Fifo \switch RegFile \switch BlockSpec \switch CharSpec) ENDFUNC
PROC ISignalAI(\switch Single | \switch SingleSafe, VAR signalai Signal, aiotrigg Condition, num HighValue, num LowValue, num DeltaValue \switch DPos | \switch DNeg, VAR intnum Interrupt) ENDPROC
PROC ISignalAO(\switch Single | \switch SingleSafe, VAR signalao Signal, aiotrigg Condition, num HighValue, num LowValue, num DeltaValue \switch DPos | \switch DNeg, VAR intnum Interrupt) ENDPROC
PROC ISignalDI(\switch Single | \switch SingleSafe, VAR signaldi Signal, dionum TriggValue, VAR intnum Interrupt) ENDPROC
PROC ISignalDO(\switch Single | \switch SingleSafe, VAR signaldo Signal, dionum TriggValue, VAR intnum Interrupt) ENDPROC
PROC ISignalGI(\switch Single | \switch SingleSafe, VAR signalgi Signal, VAR intnum Interrupt) ENDPROC
PROC ISignalGO(\switch Single | \switch SingleSafe, VAR signalgo Signal, VAR intnum Interrupt) ENDPROC
FUNC bool IsLeadThrough(\VAR mecunit MecUnit \switch Active | \switch Set) ENDFUNC
PROC ISleep(VAR intnum Interrupt) ENDPROC
FUNC bool IsMechUnitActive(VAR mecunit MechUnit) ENDFUNC
FUNC bool IsPers(anytype DatObj) ENDFUNC
FUNC bool IsStopMoveAct(\switch FromMoveTask | \switch FromNonMoveTask) ENDFUNC
FUNC bool IsSyncMoveOn() ENDFUNC
FUNC bool IsSysId(string SystemId) ENDFUNC
FUNC bool IsVar(anytype DatObj) ENDFUNC
PROC ITimer(\switch Single | \switch SingleSafe, num Time, VAR intnum Interrupt) ENDPROC
PROC IVarValue(string device, num VarNo, PERS num Value, VAR intnum Interrupt \num Unit \num DeadBand \switch ReportAtTool \num SpeedAdapt \switch APTR) ENDPROC
PROC IWatch(VAR intnum Interrupt) ENDPROC
PROC Load(\switch Dynamic, string FilePath \string File \switch CheckRef) ENDPROC
PROC LoadId(paridnum ParIdType, loadidnum LoadIdType, PERS tooldata Tool \PERS loaddata PayLoad \PERS wobjdata WObj \num ConfAngle \switch SlowTest \VAR num Accuracy) ENDPROC
PROC MakeDir(string Path) ENDPROC
FUNC num MaxRobSpeed() ENDFUNC
PROC MechUnitLoad(VAR mecunit MechUnit, num AxisNo, PERS loaddata Load) ENDPROC
FUNC robtarget MirPos(robtarget Point, wobjdata MirPlane \wobjdata WObj \switch MirY) ENDFUNC
FUNC bool ModExist(string ModuleName) ENDFUNC
FUNC dnum ModTimeDnum(string Object \VAR stringdig StrDig) ENDFUNC
FUNC num MotionPlannerNo() ENDFUNC
PROC MotionProcessModeSet(motionprocessmode Mode) ENDPROC
PROC MotionSup(\switch On | \switch Off \num Tunevalue \switch NoBackoff) ENDPROC
PROC MoveAbsJ(\switch Conc, jointtarget ToJointPos \identno ID \switch NoEOffs, speeddata Speed \num V | \num T, zonedata Zone \num Z \stoppointdata Inpos, PERS tooldata Tool \PERS wobjdata WObj \PERS loaddata TLoad) ENDPROC
PROC MoveC(\switch Conc, robtarget CirPoint, robtarget ToPoint \identno ID, speeddata Speed \num V | \num T, zonedata Zone \num Z \stoppointdata Inpos, PERS tooldata Tool \PERS wobjdata WObj \switch Corr \PERS loaddata TLoad) ENDPROC
PROC MoveCDO(robtarget CirPoint, robtarget ToPoint \identno ID, speeddata Speed \num T, zonedata Zone, PERS tooldata Tool \PERS wobjdata WObj, VAR signaldo Signal, dionum Value \PERS loaddata TLoad) ENDPROC
PROC MoveCSync(robtarget CirPoint, robtarget ToPoint \identno ID, speeddata Speed \num T, zonedata Zone, PERS tooldata Tool \PERS wobjdata WObj, string ProcName \PERS loaddata TLoad) ENDPROC
PROC MoveExtJ(\switch Conc, jointtarget ToJointPos \identno ID \switch UseEOffs, speeddata Speed \num T, zonedata Zone \stoppointdata Inpos) ENDPROC
PROC MoveJ(\switch Conc, robtarget ToPoint \identno ID, speeddata Speed \num V | \num T, zonedata Zone \num Z \stoppointdata Inpos, PERS tooldata Tool \PERS wobjdata WObj \PERS loaddata TLoad) ENDPROC
PROC MoveJDO(robtarget ToPoint \identno ID, speeddata Speed \num T, zonedata Zone, PERS tooldata Tool \PERS wobjdata WObj, VAR signaldo Signal, dionum Value \PERS loaddata TLoad) ENDPROC
PROC MoveJSync(robtarget ToPoint \identno ID, speeddata Speed \num T, zonedata Zone, PERS tooldata Tool \PERS wobjdata WObj, string ProcName \PERS loaddata TLoad) ENDPROC
PROC MoveL(\switch Conc, robtarget ToPoint \identno ID, speeddata Speed \num V | \num T, zonedata Zone \num Z \stoppointdata Inpos, PERS tooldata Tool \PERS wobjdata WObj \switch Corr \PERS loaddata TLoad) ENDPROC
PROC MoveLDO(robtarget ToPoint \identno ID, speeddata Speed \num T, zonedata Zone, PERS tooldata Tool \PERS wobjdata WObj, VAR signaldo Signal, dionum Value \PERS loaddata TLoad) ENDPROC
PROC MoveLSync(robtarget ToPoint \identno ID, speeddata Speed \num T, zonedata Zone, PERS tooldata Tool \PERS wobjdata WObj, string ProcName \PERS loaddata TLoad) ENDPROC
PROC MToolRotCalib(jointtarget RefTip, jointtarget ZPos \jointtarget XPos, PERS tooldata Tool) ENDPROC
PROC MToolTCPCalib(jointtarget Pos1, jointtarget Pos2, jointtarget Pos3, jointtarget Pos4, PERS tooldata Tool, VAR num MaxErr, VAR num MeanErr) ENDPROC
FUNC bool NonMotionMode(\switch Main) ENDFUNC
FUNC orient NOrient(orient Rotation) ENDFUNC
FUNC dnum NumToDnum(num Value) ENDFUNC
FUNC string NumToStr(num Val, num Dec \switch Exp) ENDFUNC
FUNC robtarget Offs(robtarget Point, num XOffset, num YOffset, num ZOffset) ENDFUNC
PROC Open(string Object \string File, VAR iodev IODevice \switch Read | \switch Write | \switch Append \switch Bin) ENDPROC
PROC OpenDir(VAR dir Dev, string Path) ENDPROC
FUNC symnum OpMode() ENDFUNC
FUNC orient OrientZYX(num ZAngle, num YAngle, num XAngle) ENDFUNC
FUNC robtarget ORobT(robtarget OrgPoint \switch InPDisp | \switch InEOffs) ENDFUNC
PROC PackDNHeader(string Service, string Path, VAR rawbytes RawData) ENDPROC
PROC PackRawBytes(anytype Value, VAR rawbytes RawData \switch Network, num StartIndex \switch Hex1 | \inttypes IntX | \switch Float4 | \switch ASCII) ENDPROC
FUNC bool ParIdPosValid(paridnum ParIdType, VAR jointtarget Pos, VAR bool AxValid{*} \num ConfAngle) ENDFUNC
FUNC paridvalidnum ParIdRobValid(paridnum ParIdType \VAR mecunit MechUnit \num AxisNo) ENDFUNC
PROC PathAccLim(bool AccLim \num AccMax, bool DecelLim \num DecelMax) ENDPROC
FUNC num PathLevel() ENDFUNC
PROC PathRecMoveBwd(\VAR pathrecid ID \pos ToolOffs \speeddata Speed) ENDPROC
PROC PathRecMoveFwd(\VAR pathrecid ID \pos ToolOffs \speeddata Speed) ENDPROC
PROC PathRecStart(VAR pathrecid ID) ENDPROC
FUNC bool PathRecValidBwd(\VAR pathrecid ID) ENDFUNC
FUNC bool PathRecValidFwd(\VAR pathrecid ID) ENDFUNC
PROC PathResol(num PathSampleTime) ENDPROC
PROC PDispOff() ENDPROC
PROC PDispOn(\switch Rot \robtarget ExeP, robtarget ProgPoint, PERS tooldata Tool \PERS wobjdata WObj) ENDPROC
PROC PDispSet(pose DispFrame) ENDPROC
FUNC bool PFRestart(\switch Base | \switch Irpt) ENDFUNC
FUNC pose PoseInv(pose Pose) ENDFUNC
FUNC pose PoseMult(pose Pose1, pose Pose2) ENDFUNC
FUNC pos PoseVect(pose Pose, pos Pos) ENDFUNC
FUNC num Pow(num Base, num Exponent) ENDFUNC
FUNC dnum PowDnum(dnum Base, num Exponent) ENDFUNC
FUNC bool PPMovedInManMode() ENDFUNC
FUNC bool Present(anytype OptPar) ENDFUNC
PROC ProcerrRecovery(\switch SyncOrgMoveInst | \switch SyncLastMoveInst \VAR signaldo ProcSignal) ENDPROC
FUNC num ProgMemFree() ENDFUNC
PROC PrxActivRecord(mecunit MechUnit, num Delay) ENDPROC
PROC PrxDbgStoreRecord(mecunit MechUnit, string File_name) ENDPROC
PROC PrxDeactRecord(mecunit MechUnit) ENDPROC
FUNC num PrxGetMaxRecordpos(mecunit MechUnit) ENDFUNC
PROC PrxResetPos(mecunit MechUnit) ENDPROC
PROC PrxResetRecords(mecunit MechUnit) ENDPROC
PROC PrxSetPosOffset(mecunit MechUnit, num Reference) ENDPROC
PROC PrxSetRecordSampleTime(mecunit MechUnit, num SampleTime) ENDPROC
PROC PrxSetSyncalarm(mecunit MechUnit \num Time | \switch NoPulse) ENDPROC
PROC PrxStartRecord(mecunit MechUnit, num Record_duration, num Profile_type) ENDPROC
PROC PrxStopRecord(mecunit MechUnit) ENDPROC
PROC PrxUseFileRecord(mecunit MechUnit, num Delay, string File_name) ENDPROC
PROC PulseDO(\switch High \num PLength, VAR signaldo Signal) ENDPROC
PROC RaiseToUser(\switch Continue | \switch BreakOff \errnum ErrorNumber) ENDPROC
FUNC num RawBytesLen(VAR rawbytes RawData) ENDFUNC
PROC ReadAnyBin(VAR iodev IODevice, INOUT anytype Data \num Time) ENDPROC
FUNC num ReadBin(VAR iodev IODevice \num Time) ENDFUNC
PROC ReadBlock(string device, num BlockNo, string FileName \string TaskName) ENDPROC
PROC ReadCfgData(string InstancePath, string Attribute, VAR anytype CfgData \VAR num ListNo) ENDPROC
FUNC bool ReadDir(VAR dir Dev, INOUT string FileName) ENDFUNC
PROC ReadErrData(VAR trapdata TrapEvent, VAR errdomain ErrorDomain, VAR num ErrorId, VAR errtype ErrorType \VAR string Title \VAR string Str1 \VAR string Str2 \VAR string Str3 \VAR string Str4 \VAR string Str5) ENDPROC
FUNC num ReadMotor(\VAR mecunit MecUnit, num Axis) ENDFUNC
FUNC num ReadNum(VAR iodev IODevice \string Delim \num Time) ENDFUNC
PROC ReadRawBytes(VAR iodev IODevice, VAR rawbytes RawData \num Time) ENDPROC
FUNC string ReadStrBin(VAR iodev IODevice, num NoOfChars \num Time) ENDFUNC
FUNC num ReadVar(string device, num VarNo \string TaskName) ENDFUNC
PROC ReadVarArr(string Device, INOUT sensorvardata Data{*} \string TaskName) ENDPROC
FUNC robtarget RelTool(robtarget Point, num Dx, num Dy, num Dz \num Rx \num Ry \num Rz) ENDFUNC
FUNC num RemainingRetries() ENDFUNC
PROC RemoveAllCyclicBool(\switch AllTasks) ENDPROC
PROC RemoveCyclicBool(PERS bool Flag | string Name) ENDPROC
PROC RemoveDir(string Path) ENDPROC
PROC RemoveFile(string Path) ENDPROC
PROC RemoveSuperv(VAR signaldi Signal, num Condition, num Listtype) ENDPROC
PROC RenameFile(string OldPath, string NewPath) ENDPROC
PROC Reset(VAR signaldo Signal) ENDPROC
PROC ResetAxisDistance(VAR mecunit MechUnit, VAR num AxisNo) ENDPROC
PROC ResetAxisMoveTime(VAR mecunit MechUnit, VAR num AxisNo) ENDPROC
PROC ResetPPMoved() ENDPROC
PROC ResetRetryCount() ENDPROC
PROC RestoPath() ENDPROC
PROC Rewind(VAR iodev IODevice) ENDPROC
PROC RMQEmptyQueue() ENDPROC
PROC RMQFindSlot(VAR rmqslot Slot, string Name) ENDPROC
PROC RMQGetMessage(VAR rmqmessage Message) ENDPROC
PROC RMQGetMsgData(VAR rmqmessage Message, VAR anytype Data) ENDPROC
PROC RMQGetMsgHeader(VAR rmqmessage Message \VAR rmqheader Header \VAR rmqslot SenderId \VAR num UserDef) ENDPROC
FUNC string RMQGetSlotName(VAR rmqslot Slot) ENDFUNC
PROC RMQReadWait(VAR rmqmessage Message \num TimeOut) ENDPROC
PROC RMQSendMessage(VAR rmqslot Slot, anytype SendData \num UserDef) ENDPROC
FUNC string RobName() ENDFUNC
FUNC bool RobOS() ENDFUNC
FUNC num Round(num Val \num Dec) ENDFUNC
FUNC dnum RoundDnum(dnum Val \num Dec) ENDFUNC
FUNC symnum RunMode(\switch Main) ENDFUNC
FUNC string SafetyControllerGetChecksum() ENDFUNC
FUNC string SafetyControllerGetOpModePinCode() ENDFUNC
FUNC string SafetyControllerGetSWVersion() ENDFUNC
FUNC string SafetyControllerGetUserChecksum() ENDFUNC
PROC SafetyControllerSyncRequest() ENDPROC
PROC Save(\VAR taskid TaskRef | \string TaskName, string ModuleName \string FilePath \string File) ENDPROC
PROC SaveCfgData(string FilePath \string File, cfgdomain Domain) ENDPROC
PROC SearchL(\switch Stop | \switch PStop | \switch SStop | \switch Sup, VAR signaldi Signal | PERS bool PersBool \switch Flanks | \switch PosFlank | \switch NegFlank | \switch HighLevel | \switch LowLevel, INOUT robtarget SearchPoint, robtarget ToPoint \identno ID, speeddata Speed \num V | \num T, PERS tooldata Tool \PERS wobjdata WObj \switch Corr \PERS loaddata TLoad) ENDPROC
PROC Set(VAR signaldo Signal) ENDPROC
PROC SetAllDataVal(string Type \string TypeMod \string Object \switch Hidden, VAR anytype Value) ENDPROC
PROC SetAO(VAR signalao Signal, num Value) ENDPROC
PROC SetDataSearch(string Type \string TypeMod \string Object \switch PersSym \switch VarSym \switch ConstSym \switch InTask | \string InMod \string InRout \switch GlobalSym | \switch LocalSym) ENDPROC
PROC SetDataVal(string Object \VAR datapos Block | \VAR taskid TaskRef | \string TaskName, VAR anytype Value) ENDPROC
PROC SetDO(\num SDelay | \switch Sync, VAR signaldo Signal, dionum Value) ENDPROC
PROC SetGO(\num SDelay, VAR signalgo Signal, num Value | dnum Dvalue) ENDPROC
PROC SetLeadThrough(\switch On | \switch Off \switch NoStopMove | \switch NoStartMove \switch NoClearPath) ENDPROC
PROC SetSysData(PERS anytype SourceObject \string ObjectName) ENDPROC
PROC SetupCyclicBool(PERS bool Flag, bool Cond \VAR signaldo Signal) ENDPROC
PROC SetupSuperv(VAR signaldi Signal, num Condition, num Listtype \VAR signaldo ErrIndSig) ENDPROC
PROC SiClose(PERS sensor Sensor) ENDPROC
PROC SiConnect(PERS sensor Sensor \switch NoStop) ENDPROC
PROC SiGetCyclic(PERS sensor Sensor, PERS anytype Data, num Rate) ENDPROC
FUNC num Sin(num Angle) ENDFUNC
FUNC dnum SinDnum(dnum Angle) ENDFUNC
PROC SingArea(\switch Wrist | \switch LockAxis4 | \switch Off) ENDPROC
PROC SiSetCyclic(PERS sensor Sensor, PERS anytype Data, num Rate) ENDPROC
PROC SkipWarn() ENDPROC
PROC SocketAccept(VAR socketdev Socket, VAR socketdev ClientSocket \VAR string ClientAddress \num Time) ENDPROC
PROC SocketBind(VAR socketdev Socket, string LocalAddress, num LocalPort) ENDPROC
PROC SocketClose(VAR socketdev Socket) ENDPROC
PROC SocketConnect(VAR socketdev Socket, string Address, num Port \num Time) ENDPROC
PROC SocketCreate(VAR socketdev Socket \switch UDP) ENDPROC
FUNC socketstatus SocketGetStatus(VAR socketdev Socket) ENDFUNC
PROC SocketListen(VAR socketdev Socket) ENDPROC
FUNC num SocketPeek(VAR socketdev Socket) ENDFUNC
PROC SocketReceive(VAR socketdev Socket \VAR string Str | \VAR rawbytes RawData | \VAR byte Data{*} \num ReadNoOfBytes \VAR num NoRecBytes \num Time) ENDPROC
PROC SocketReceiveFrom(VAR socketdev Socket \VAR string Str | \VAR rawbytes RawData | \VAR byte Data{*} \VAR num NoRecBytes, VAR string RemoteAddress, VAR num RemotePort \num Time) ENDPROC
PROC SocketSend(VAR socketdev Socket \string Str | \VAR rawbytes RawData | \byte Data{*} \num NoOfBytes) ENDPROC
PROC SocketSendTo(VAR socketdev Socket, string RemoteAddress, num RemotePort \string Str | \VAR rawbytes RawData | \byte Data{*} \num NoOfBytes) ENDPROC
PROC SoftAct(\VAR mecunit MechUnit, num Axis, num Softness \num Ramp) ENDPROC
PROC SoftDeact(\num Ramp) ENDPROC
PROC SpeedLimAxis(VAR mecunit MechUnit, num AxisNo, num AxisSpeed) ENDPROC
PROC SpeedLimCheckPoint(num RobSpeed) ENDPROC
PROC SpeedRefresh(num Override) ENDPROC
PROC SpyStart(string File) ENDPROC
PROC SpyStop() ENDPROC
FUNC num Sqrt(num Value) ENDFUNC
FUNC dnum SqrtDnum(dnum Value) ENDFUNC
PROC StartLoad(\switch Dynamic, string FilePath \string File, VAR loadsession LoadNo) ENDPROC
PROC StartMove(\switch AllMotionTasks) ENDPROC
PROC StartMoveRetry() ENDPROC
FUNC num STCalcForce(string ToolName, num MotorTorque) ENDFUNC
FUNC num STCalcTorque(string ToolName, num TipForce) ENDFUNC
PROC STCalib(string ToolName \switch ToolChg | \switch TipChg | \switch TipWear \INOUT num RetTipWear) ENDPROC
PROC StepBwdPath(num StepLength, num StepTime) ENDPROC
PROC STIndGunReset(string ToolName) ENDPROC
FUNC bool STIsCalib(string ToolName \switch sguninit | \switch sgunsynch) ENDFUNC
FUNC bool STIsClosed(string ToolName) ENDFUNC
FUNC bool STIsIndGun(string ToolName) ENDFUNC
FUNC bool STIsOpen(string ToolName) ENDFUNC
PROC SToolRotCalib(robtarget RefTip, robtarget ZPos, robtarget XPos, PERS tooldata Tool) ENDPROC
PROC SToolTCPCalib(robtarget Pos1, robtarget Pos2, robtarget Pos3, robtarget Pos4, PERS tooldata Tool, VAR num MaxErr, VAR num MeanErr) ENDPROC
PROC Stop(\switch NoRegain | \switch AllMoveTasks) ENDPROC
PROC StopMove(\switch Quick \switch AllMotionTasks) ENDPROC
PROC StopMoveReset(\switch AllMotionTasks) ENDPROC
PROC StorePath(\switch KeepSync) ENDPROC
FUNC stringdig StrDigCalc(stringdig StrDig1, opcalc Operation, stringdig StrDig2) ENDFUNC
FUNC bool StrDigCmp(stringdig StrDig1, opnum Relation, stringdig StrDig2) ENDFUNC
FUNC num StrFind(string Str, num ChPos, string Set \switch NotInSet) ENDFUNC
FUNC num StrLen(string Str) ENDFUNC
FUNC string StrMap(string Str, string FromMap, string ToMap) ENDFUNC
FUNC num StrMatch(string Str, num ChPos, string Pattern) ENDFUNC
FUNC bool StrMemb(string Str, num ChPos, string Set) ENDFUNC
FUNC bool StrOrder(string Str1, string Str2, string Order) ENDFUNC
FUNC string StrPart(string Str, num ChPos, num Len) ENDFUNC
FUNC byte StrToByte(string ConStr \switch Hex | \switch Okt | \switch Bin | \switch Char) ENDFUNC
FUNC bool StrToVal(string Str, INOUT anytype Val) ENDFUNC
PROC STTune(VAR mecunit MecUnit, num TuneValue, tunegtype Type) ENDPROC
PROC SupSyncSensorOff(VAR mecunit MechUnit) ENDPROC
PROC SupSyncSensorOn(VAR mecunit MechUnit, num MaxSyncSup, num SafetyDist, num MinSyncSup \num SafetyDelay) ENDPROC
PROC SyncMoveOff(VAR syncident SyncID \num TimeOut) ENDPROC
PROC SyncMoveOn(VAR syncident SyncID, PERS tasks TaskList{*} \num TimeOut) ENDPROC
PROC SyncMoveResume() ENDPROC
PROC SyncMoveSuspend() ENDPROC
PROC SyncMoveUndo() ENDPROC
PROC SyncToSensor(VAR mecunit MechUnit \switch MaxSync \switch On | \switch Off) ENDPROC
PROC SystemStopAction(\switch Stop | \switch StopBlock | \switch Halt) ENDPROC
FUNC num Tan(num Angle) ENDFUNC
FUNC dnum TanDnum(dnum Angle) ENDFUNC
FUNC tsp_status TaskIsActive(VAR taskid TaskRef | string TaskName) ENDFUNC
FUNC bool TaskRunMec() ENDFUNC
FUNC bool TaskRunRob() ENDFUNC
FUNC bool TestAndSet(INOUT bool Object) ENDFUNC
FUNC bool TestDI(VAR signaldi Signal) ENDFUNC
PROC TestSignDefine(num Channel, testsignal SignalId, VAR mecunit MechUnit, num Axis, num SampleTime) ENDPROC
FUNC num TestSignRead(num Channel) ENDFUNC
PROC TestSignReset() ENDPROC
FUNC string TextGet(num Table, num Index) ENDFUNC
FUNC bool TextTabFreeToUse(string TableName) ENDFUNC
FUNC num TextTabGet(string TableName) ENDFUNC
PROC TextTabInstall(string File) ENDPROC
PROC TPErase() ENDPROC
PROC TPReadDnum(INOUT dnum TPAnswer, string TPText \num MaxTime \VAR signaldi DIBreak \switch DIPassive \VAR signaldo DOBreak \switch DOPassive \PERS bool PersBoolBreak \switch PersBoolPassive \INOUT errnum BreakFlag) ENDPROC
PROC TPReadFK(INOUT num TPAnswer, string TPText, string TPFK1, string TPFK2, string TPFK3, string TPFK4, string TPFK5 \num MaxTime \VAR signaldi DIBreak \switch DIPassive \VAR signaldo DOBreak \switch DOPassive \PERS bool PersBoolBreak \switch PersBoolPassive \INOUT errnum BreakFlag) ENDPROC
PROC TPReadNum(INOUT num TPAnswer, string TPText \num MaxTime \VAR signaldi DIBreak \switch DIPassive \VAR signaldo DOBreak \switch DOPassive \PERS bool PersBoolBreak \switch PersBoolPassive \INOUT errnum BreakFlag) ENDPROC
PROC TPShow(tpnum Window) ENDPROC
PROC TPWrite(string TPText \num Num | \bool Bool | \pos Pos | \orient Orient | \dnum Dnum) ENDPROC
PROC TriggC(\switch Conc, robtarget CirPoint, robtarget ToPoint \identno ID, speeddata Speed \num T, VAR triggdata Trigg_1 | VAR triggdata TriggArray{*} \VAR triggdata T2 \VAR triggdata T3 \VAR triggdata T4 \VAR triggdata T5 \VAR triggdata T6 \VAR triggdata T7 \VAR triggdata T8, zonedata Zone \stoppointdata Inpos, PERS tooldata Tool \PERS wobjdata WObj \switch Corr \PERS loaddata TLoad) ENDPROC
PROC TriggDataCopy(VAR triggdata Source, VAR triggdata Destination) ENDPROC
PROC TriggDataReset(VAR triggdata TriggData) ENDPROC
FUNC bool TriggDataValid(VAR triggdata TriggData) ENDFUNC
PROC TriggEquip(VAR triggdata TriggData, num Distance \switch Start | \switch Next, num EquipLag \VAR signaldo DOp | \VAR signalgo GOp | \VAR signalao AOp | \num ProcID, num SetValue | dnum SetDvalue \PERS bool Inhib \PERS anytype InhibSetValue \triggmode Mode) ENDPROC
PROC TriggInt(VAR triggdata TriggData, num Distance \switch Start | \switch Time, VAR intnum Interrupt \PERS bool Inhib \PERS anytype InhibSetValue \triggmode Mode) ENDPROC
PROC TriggIO(VAR triggdata TriggData, num Distance \switch Start | \switch Time \VAR signaldo DOp | \VAR signalgo GOp | \VAR signalao AOp | \num ProcID, num SetValue | dnum SetDvalue \num DODelay \PERS bool Inhib \PERS anytype InhibSetValue \triggmode Mode) ENDPROC
PROC TriggJ(\switch Conc, robtarget ToPoint \identno ID, speeddata Speed \num T, VAR triggdata Trigg_1 | VAR triggdata TriggArray{*} \VAR triggdata T2 \VAR triggdata T3 \VAR triggdata T4 \VAR triggdata T5 \VAR triggdata T6 \VAR triggdata T7 \VAR triggdata T8, zonedata Zone \stoppointdata Inpos, PERS tooldata Tool \PERS wobjdata WObj \PERS loaddata TLoad) ENDPROC
PROC TriggL(\switch Conc, robtarget ToPoint \identno ID, speeddata Speed \num T, VAR triggdata Trigg_1 | VAR triggdata TriggArray{*} \VAR triggdata T2 \VAR triggdata T3 \VAR triggdata T4 \VAR triggdata T5 \VAR triggdata T6 \VAR triggdata T7 \VAR triggdata T8, zonedata Zone \stoppointdata Inpos, PERS tooldata Tool \PERS wobjdata WObj \switch Corr \PERS loaddata TLoad) ENDPROC
PROC TriggSpeed(VAR triggdata TriggData, num Distance \switch Start | \switch Next, num ScaleLag, VAR signalao AOp, num ScaleValue \num DipLag \VAR signaldo ErrDO \PERS bool Inhib \PERS anytype InhibSetValue \triggmode Mode) ENDPROC
PROC TriggStopProc(PERS restartdata RestartRef \VAR signaldo DO1 \VAR signalgo GO1 \VAR signalgo GO2 \VAR signalgo GO3 \VAR signalgo GO4, VAR signaldo ShadowDO) ENDPROC
FUNC num Trunc(num Val \num Dec) ENDFUNC
FUNC dnum TruncDnum(dnum Val \num Dec) ENDFUNC
PROC TryInt(num DataObj | dnum DataObj2) ENDPROC
PROC TuneReset() ENDPROC
PROC TuneServo(VAR mecunit MecUnit, num Axis, num TuneValue \tunetype Type) ENDPROC
FUNC string Type(anytype Data \switch BaseName) ENDFUNC
FUNC string UIAlphaEntry(\string Header \string Message | \string MsgArray{*} \switch Wrap \icondata Icon \string InitString \num MaxTime \VAR signaldi DIBreak \switch DIPassive \VAR signaldo DOBreak \switch DOPassive \PERS bool PersBoolBreak \switch PersBoolPassive \INOUT errnum BreakFlag \VAR signaldo UIActiveSignal) ENDFUNC
FUNC bool UIClientExist() ENDFUNC
FUNC dnum UIDnumEntry(\string Header \string Message | \string MsgArray{*} \switch Wrap \icondata Icon \dnum InitValue \dnum MinValue \dnum MaxValue \switch AsInteger \num MaxTime \VAR signaldi DIBreak \switch DIPassive \VAR signaldo DOBreak \switch DOPassive \PERS bool PersBoolBreak \switch PersBoolPassive \INOUT errnum BreakFlag \VAR signaldo UIActiveSignal) ENDFUNC
FUNC btnres UIMessageBox(\string Header \string Message | \string MsgArray{*} \switch Wrap \buttondata Buttons | \string BtnArray{*} \btnres DefaultBtn \icondata Icon \string Image \num MaxTime \VAR signaldi DIBreak \switch DIPassive \VAR signaldo DOBreak \switch DOPassive \PERS bool PersBoolBreak \switch PersBoolPassive \INOUT errnum BreakFlag \VAR signaldo UIActiveSignal) ENDFUNC
PROC UIMsgBox(\string Header, string MsgLine1 \string MsgLine2 \string MsgLine3 \string MsgLine4 \string MsgLine5 \switch Wrap \buttondata Buttons \icondata Icon \string Image \INOUT btnres Result \num MaxTime \VAR signaldi DIBreak \switch DIPassive \VAR signaldo DOBreak \switch DOPassive \PERS bool PersBoolBreak \switch PersBoolPassive \INOUT errnum BreakFlag \VAR signaldo UIActiveSignal) ENDPROC
PROC UIMsgWrite(string Header, string Message | \string MsgArray{*} \switch Wrap \icondata Icon \string Image \bool PersBool | \string PersBoolName \bool AbortValue \VAR signaldo UIActiveSignal) ENDPROC
PROC UIMsgWriteAbort() ENDPROC
FUNC num UINumEntry(\string Header \string Message | \string MsgArray{*} \switch Wrap \icondata Icon \num InitValue \num MinValue \num MaxValue \switch AsInteger \num MaxTime \VAR signaldi DIBreak \switch DIPassive \VAR signaldo DOBreak \switch DOPassive \PERS bool PersBoolBreak \switch PersBoolPassive \INOUT errnum BreakFlag \VAR signaldo UIActiveSignal) ENDFUNC
PROC UIShow(string AssemblyName, string TypeName \string InitCmd \PERS uishownum InstanceId \VAR num Status \switch NoCloseBtn) ENDPROC
PROC UnLoad(\switch ErrIfChanged | \switch Save, string FilePath \string File) ENDPROC
PROC UnpackRawBytes(VAR rawbytes RawData \switch Network, num StartIndex, VAR anytype Value \switch Hex1 | \inttypes IntX | \switch Float4 | \num ASCII) ENDPROC
FUNC bool ValidIO(VAR anytype Signal) ENDFUNC
FUNC string ValToStr(anytype Val) ENDFUNC
FUNC num VectMagn(pos Vector) ENDFUNC
PROC VelSet(num Override, num Max) ENDPROC
PROC WaitDI(VAR signaldi Signal, dionum Value \num MaxTime | \num ValueAtTimeout \VAR bool TimeFlag \switch Visualize \string Header \string Message | \string MsgArray{*} \switch Wrap \icondata Icon \string Image \num VisualizeTime \VAR signaldo UIActiveSignal) ENDPROC
PROC WaitDO(VAR signaldo Signal, dionum Value \num MaxTime | \num ValueAtTimeout \VAR bool TimeFlag \switch Visualize \string Header \string Message | \string MsgArray{*} \switch Wrap \icondata Icon \string Image \num VisualizeTime \VAR signaldo UIActiveSignal) ENDPROC
PROC WaitLoad(\string UnloadPath \string UnloadFile, VAR loadsession LoadNo \switch CheckRef) ENDPROC
PROC WaitRob(\switch InPos | \switch ZeroSpeed) ENDPROC
PROC WaitSensor(VAR mecunit MechUnit \num RelDist \num PredTime \num MaxTime \VAR bool TimeFlag) ENDPROC
PROC WaitSyncTask(\switch InPos, VAR syncident SyncID, PERS tasks TaskList{*} \num TimeOut) ENDPROC
PROC WaitTestAndSet(PERS bool Object) ENDPROC
PROC WaitTime(\switch InPos, num Time) ENDPROC
PROC WaitUntil(\switch InPos, bool Cond \num MaxTime \INOUT bool TimeFlag \num PollRate \switch Visualize \string Header \string Message | \string MsgArray{*} \switch Wrap \icondata Icon \string Image \num VisualizeTime \VAR signaldo UIActiveSignal) ENDPROC
PROC WaitWObj(PERS wobjdata WObj) ENDPROC
PROC WarmStart() ENDPROC
PROC WorldAccLim(\num On | \switch Off) ENDPROC
PROC Write(VAR iodev IODevice, string String \num Num | \bool Bool | \pos Pos | \orient Orient | \dnum Dnum \switch NoNewLine) ENDPROC
PROC WriteBin(VAR iodev IODevice, num Buffer{*}, num NChar) ENDPROC
PROC WriteBlock(string device, num BlockNo, string FileName \string TaskName) ENDPROC
PROC WriteCfgData(string InstancePath, string Attribute, anytype CfgData \VAR num ListNo) ENDPROC
PROC WriteRawBytes(VAR iodev IODevice, VAR rawbytes RawData \num NoOfBytes) ENDPROC
PROC WriteStrBin(VAR iodev IODevice, string Str) ENDPROC
PROC WriteVar(string device, num VarNo, num VarData \string TaskName) ENDPROC
PROC WriteVarArr(string Device, INOUT sensorvardata Data{*} \string TaskName) ENDPROC
PROC WZBoxDef(\switch Inside | \switch Outside, VAR shapedata Shape, pos LowPoint, pos HighPoint) ENDPROC
PROC WZCylDef(\switch Inside | \switch Outside, VAR shapedata Shape, pos CentrePoint, num Radius, num Height) ENDPROC
PROC WZDisable(INOUT wztemporary WorldZone) ENDPROC
PROC WZDOSet(\switch Temp | \switch Stat, INOUT anytype WorldZone \switch Inside | \switch Before, VAR shapedata Shape, VAR signaldo Signal, dionum SetValue) ENDPROC
PROC WZEnable(INOUT wztemporary WorldZone) ENDPROC
PROC WZFree(INOUT wztemporary WorldZone) ENDPROC
PROC WZHomeJointDef(\switch Inside | \switch Outside, VAR shapedata Shape, jointtarget MiddleJointVal, jointtarget DeltaJointVal) ENDPROC
PROC WZLimJointDef(\switch Inside | \switch Outside, VAR shapedata Shape, jointtarget LowJointVal, jointtarget HighJointVal) ENDPROC
PROC WZLimSup(\switch Temp | \switch Stat, INOUT anytype WorldZone, VAR shapedata Shape) ENDPROC
PROC WZSphDef(\switch Inside | \switch Outside, VAR shapedata Shape, pos CentrePoint, num Radius) ENDPROC
ENDMODULE
