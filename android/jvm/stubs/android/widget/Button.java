package android.widget;

import android.content.Context;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public class Button extends TextView {
    public Button(Context context) {
        super(context);
    }
}
