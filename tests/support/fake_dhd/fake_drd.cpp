// A stand-in for the vendor's libdrd: it needs the fake libdhd and initializes its device.
extern "C" {

int fakeDhdInitialize(char id);
bool fakeDhdIsCalibrated(char id);
bool fakeDhdHas(const char* fault);
void fakeDhdSetError(int code);

int drdOpenID(char id) { return id; }
int drdClose(char) { return 0; }
bool drdIsSupported(char) { return !fakeDhdHas("unsupported"); }
bool drdIsInitialized(char id) { return fakeDhdIsCalibrated(id); }
int drdAutoInit(char id) {
    const int code = fakeDhdInitialize(id);
    if (code == 0) return 0;
    fakeDhdSetError(code);
    return -1;
}
}
