package android.os;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public final class Build {
    public static final String MANUFACTURER = "";
    public static final String MODEL = "";

    private Build() {}

    /** Level of the interface. */
    public static final class VERSION {
        public static final int SDK_INT = Integer.parseInt("26");

        private VERSION() {}
    }
}
