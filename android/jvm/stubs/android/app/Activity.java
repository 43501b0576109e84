package android.app;

import android.content.Context;
import android.content.Intent;
import android.os.Bundle;
import android.view.MotionEvent;
import android.view.View;
import android.view.Window;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public class Activity extends Context {
    protected void onCreate(Bundle state) {}

    protected void onStart() {}

    protected void onStop() {}

    protected void onDestroy() {}

    public boolean dispatchTouchEvent(MotionEvent event) {
        return false;
    }

    public Intent getIntent() {
        throw new UnsupportedOperationException();
    }

    public Window getWindow() {
        throw new UnsupportedOperationException();
    }

    public void setContentView(View view) {}
}
